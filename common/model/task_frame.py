"""Task parameters {A, b}: a coordinate system seen by the robot (Eqs. 1 and 8).

The same frames serve positions and poses: of a pose, A turns the orientation too, while the rotational part
of a tangent, being in the axes of the body, is the same in every frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput
from farhand.common.model.kernel import kernel
from farhand.common.model.manifold import POSE

Array = NDArray[np.float64]

_ORTHOGONALITY_TOLERANCE = 1e-6
_NO_ORIENTATION = np.zeros(4)


@dataclass(frozen=True, eq=False)
class TaskFrame:
    """Candidate coordinate system at one instant.

    Args:
        A: Orientation of the frame in the world, orthonormal. Shape (D, D).
        b: Origin of the frame in the world [m]. Shape (D,).

    Raises:
        InvalidInput: When a shape is wrong, a value is not finite or A is not orthonormal.
    """

    A: Array
    b: Array

    def __post_init__(self) -> None:
        A, b = (np.array(array, dtype=float, order="C") for array in (self.A, self.b))
        if b.ndim != 1 or A.shape != (b.size, b.size):
            raise InvalidInput("task frame", "A, b", f"shapes (D, D) and (D,), got {A.shape} and {b.shape}")
        if not _is_finite(A, b):
            raise InvalidInput("task frame", "A, b", "finite numbers only")
        if not _is_orthonormal(A):
            raise InvalidInput("task frame", "A", "an orthonormal matrix (A A^T = I)")
        if _is_mirrored(A):
            raise InvalidInput("task frame", "A", "a rotation (det A = 1), not a mirror image")
        A.setflags(write=False)
        b.setflags(write=False)
        object.__setattr__(self, "A", A)
        object.__setattr__(self, "b", b)

    @classmethod
    def identity(cls, n_dims: int) -> TaskFrame:
        """Return the world itself as a frame."""
        return cls(np.eye(n_dims), np.zeros(n_dims))

    @classmethod
    def at(cls, point: Array) -> TaskFrame:
        """Return the frame of a body at a position (D,), with the axes of the world, or at a pose (7,)."""
        if point.size != POSE.n_coordinates:
            return cls(np.eye(point.size), point)
        A = np.empty((3, 3))
        _matrix(point[3], point[4], point[5], point[6], A)
        return cls(A, point[:3])

    @property
    def n_dims(self) -> int:
        """Dimension D of the space."""
        return self.b.size

    @cached_property
    def quat_wxyz(self) -> Array:
        """Return the orientation A as a unit quaternion. Shape (4,).

        Raises:
            InvalidInput: When the frame is not one of space, or a mirror image.
        """
        quat = np.empty(4)
        if self.n_dims != 3 or not _quaternion(self.A, quat):
            raise InvalidInput("task frame", "A", "a rotation of space, which orientations need")
        return quat

    def to_local(self, points: Array) -> Array:
        """Return points of the world in this frame, Eq. 1. Shape (..., D) [m], or (..., 7) for poses."""
        points = np.array(points, dtype=float, order="C")  # a copy: one kind of array, one compiled function
        out = np.empty(points.shape)
        _rows_to_local(self.A, self.b, self._turn(points), _rows(points), _rows(out))
        return out

    def to_world(self, points: Array) -> Array:
        """Return points of this frame in the world, Eq. 8. Shape (..., D) [m], or (..., 7) for poses."""
        points = np.array(points, dtype=float, order="C")  # a copy: one kind of array, one compiled function
        out = np.empty(points.shape)
        _rows_to_world(self.A, self.b, self._turn(points), _rows(points), _rows(out))
        return out

    def covariance_to_world(self, covariances: Array) -> Array:
        """Return covariances of this frame in the world, Eq. 8. Shape (..., T, T) [m, rad]."""
        covariances = np.asarray(covariances, dtype=float)
        turn = np.eye(covariances.shape[-1])
        turn[: self.n_dims, : self.n_dims] = self.A
        return turn @ covariances @ turn.T

    def _turn(self, points: Array) -> Array:
        """Turn the orientations of the points, if they have any."""
        if points.shape[-1] == self.n_dims:
            return _NO_ORIENTATION
        if points.shape[-1] != self.n_dims + 4:
            expected = f"{self.n_dims} numbers, or 7 for poses, got shape {points.shape}"
            raise InvalidInput("task frame", "points", expected)
        return self.quat_wxyz


def _rows(array: Array) -> Array:
    return array.reshape(-1, array.shape[-1])


class FrameArrays(NamedTuple):
    """Task frames, P of them, as arrays for the kernels."""

    A: Array  # (P, D, D)
    b: Array  # (P, D)
    quat_wxyz: Array  # (P, 4), or (0, 4) where there are no orientations

    @classmethod
    def of(cls, frames: Sequence[TaskFrame], oriented: bool) -> FrameArrays:
        """Stack the arrays of some frames.

        Raises:
            InvalidInput: When orientations are wanted of frames that have none.
        """
        A, b = np.array([frame.A for frame in frames]), np.array([frame.b for frame in frames])
        return cls(A, b, np.array([frame.quat_wxyz for frame in frames]) if oriented else np.empty((0, 4)))


@kernel
def point_to_local(A, b, quat, point, out):
    """Apply Eq. 1 for one frame and one point. Shapes (D, D), (D,), (4,), (C,), (C,)."""
    D = b.size
    for k in range(D):
        out[k] = 0.0
        for m in range(D):
            out[k] += A[m, k] * (point[m] - b[m])
    if point.size > D:
        _turn(quat[0], -quat[1], -quat[2], -quat[3], point[D:], out[D:])


@kernel
def point_to_world(A, b, quat, point, out):
    """Apply Eq. 8 for one frame and one point. Shapes (D, D), (D,), (4,), (C,), (C,)."""
    D = b.size
    for k in range(D):
        out[k] = b[k]
        for m in range(D):
            out[k] += A[k, m] * point[m]
    if point.size > D:
        _turn(quat[0], quat[1], quat[2], quat[3], point[D:], out[D:])


@kernel
def matrix_to_world(A, matrix, out, room):
    """Write diag(A, I) M diag(A, I)^T to out, M a covariance or a precision. Shapes (D, D), (T, T)."""
    D, T = A.shape[0], matrix.shape[0]
    for a in range(T):
        for c in range(T):
            room[a, c] = matrix[a, c]
        for c in range(D):
            room[a, c] = 0.0
            for m in range(D):
                room[a, c] += matrix[a, m] * A[c, m]
    for c in range(T):
        for a in range(T):
            out[a, c] = room[a, c]
        for a in range(D):
            out[a, c] = 0.0
            for m in range(D):
                out[a, c] += A[a, m] * room[m, c]


@kernel
def _is_finite(A, b):
    for k in range(b.size):
        if not np.isfinite(b[k]):
            return False
        for m in range(b.size):
            if not np.isfinite(A[k, m]):
                return False
    return True


@kernel
def _is_orthonormal(A):
    for k in range(A.shape[0]):
        for m in range(k + 1):
            product = 0.0
            for i in range(A.shape[0]):
                product += A[k, i] * A[m, i]
            if abs(product - (1.0 if k == m else 0.0)) > _ORTHOGONALITY_TOLERANCE:
                return False
    return True


@kernel
def _is_mirrored(A):
    """Decide whether the determinant of an orthonormal matrix of the plane or of space is -1."""
    if A.shape[0] == 2:
        return A[0, 0] * A[1, 1] < A[0, 1] * A[1, 0]
    if A.shape[0] != 3:
        return False
    x = A[1, 1] * A[2, 2] - A[1, 2] * A[2, 1]
    y = A[1, 2] * A[2, 0] - A[1, 0] * A[2, 2]
    z = A[1, 0] * A[2, 1] - A[1, 1] * A[2, 0]
    return A[0, 0] * x + A[0, 1] * y + A[0, 2] * z < 0.0


@kernel
def _matrix(w, x, y, z, out):
    """Write the rotation of a unit quaternion to out (Rodrigues). Shape (3, 3)."""
    out[0, 0], out[1, 1], out[2, 2] = (
        1.0 - 2.0 * (y * y + z * z),
        1.0 - 2.0 * (x * x + z * z),
        1.0 - 2.0 * (x * x + y * y),
    )
    out[0, 1], out[1, 0] = 2.0 * (x * y - w * z), 2.0 * (x * y + w * z)
    out[0, 2], out[2, 0] = 2.0 * (x * z + w * y), 2.0 * (x * z - w * y)
    out[1, 2], out[2, 1] = 2.0 * (y * z - w * x), 2.0 * (y * z + w * x)


@kernel
def _quaternion(A, out):
    """Write the unit quaternion of a rotation to out; return whether it is one, and no mirror image.

    Of the four ways to compute it this takes the one that divides by the largest number (Shepperd).
    """
    trace = A[0, 0] + A[1, 1] + A[2, 2]
    i = 0
    for k in range(3):
        if A[k, k] > A[i, i]:
            i = k
    if trace > A[i, i]:
        out[0] = 1.0 + trace
        out[1], out[2], out[3] = A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1]
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        out[0] = A[k, j] - A[j, k]
        out[1 + i] = 1.0 + A[i, i] - A[j, j] - A[k, k]
        out[1 + j], out[1 + k] = A[j, i] + A[i, j], A[k, i] + A[i, k]
    norm = np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2 + out[3] ** 2)
    for k in range(4):
        out[k] /= norm
    determinant = A[0, 0] * (A[1, 1] * A[2, 2] - A[1, 2] * A[2, 1])
    determinant -= A[0, 1] * (A[1, 0] * A[2, 2] - A[1, 2] * A[2, 0])
    determinant += A[0, 2] * (A[1, 0] * A[2, 1] - A[1, 1] * A[2, 0])
    return determinant > 0.0


@kernel
def _turn(w, x, y, z, q, out):
    """Turn the orientations of the points, if they have any."""
    out[0] = w * q[0] - x * q[1] - y * q[2] - z * q[3]
    out[1] = w * q[1] + x * q[0] + y * q[3] - z * q[2]
    out[2] = w * q[2] - x * q[3] + y * q[0] + z * q[1]
    out[3] = w * q[3] + x * q[2] - y * q[1] + z * q[0]


@kernel
def _rows_to_world(A, b, quat, points, out):
    for row in range(points.shape[0]):
        point_to_world(A, b, quat, points[row], out[row])


@kernel
def _rows_to_local(A, b, quat, points, out):
    for row in range(points.shape[0]):
        point_to_local(A, b, quat, points[row], out[row])
