"""Task parameters {A, b}: a coordinate system seen by the robot (Eqs. 1 and 8).

The same frames serve positions and poses: of a pose, A turns the orientation too, while the rotational part
of a tangent, being in the axes of the body, is the same in every frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from common.errors import InvalidInput

Array = NDArray[np.float64]

_ORTHOGONALITY_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class TaskFrame:
    """A candidate coordinate system at one instant.

    Args:
        A: Orientation of the frame in the world, orthonormal. Shape (D, D).
        b: Origin of the frame in the world [m]. Shape (D,).

    Raises:
        InvalidInput: When a shape is wrong, a value is not finite or A is not orthonormal.
    """

    A: Array
    b: Array

    def __post_init__(self) -> None:
        A, b = np.array(self.A, dtype=float), np.array(self.b, dtype=float)
        if b.ndim != 1 or A.shape != (b.size, b.size):
            raise InvalidInput("task frame", "A, b", f"shapes (D, D) and (D,), got {A.shape} and {b.shape}")
        if not (np.isfinite(A).all() and np.isfinite(b).all()):
            raise InvalidInput("task frame", "A, b", "finite numbers only")
        if np.abs(A @ A.T - np.eye(b.size)).max() > _ORTHOGONALITY_TOLERANCE:
            raise InvalidInput("task frame", "A", "an orthonormal matrix (A A^T = I)")
        A.setflags(write=False)
        b.setflags(write=False)
        object.__setattr__(self, "A", A)
        object.__setattr__(self, "b", b)

    @classmethod
    def identity(cls, n_dims: int) -> TaskFrame:
        """The world itself as a frame."""
        return cls(np.eye(n_dims), np.zeros(n_dims))

    @property
    def n_dims(self) -> int:
        """Dimension D of the space."""
        return self.b.size

    @cached_property
    def quat_wxyz(self) -> Array:
        """Orientation A as a unit quaternion. Shape (4,).

        Raises:
            InvalidInput: When the frame is not one of space, or a mirror image.
        """
        if self.n_dims != 3 or np.linalg.det(self.A) < 0.0:
            raise InvalidInput("task frame", "A", "a rotation of space, which orientations need")
        return Rotation.from_matrix(self.A).as_quat(scalar_first=True)

    def to_local(self, points: Array) -> Array:
        """Points of the world seen from this frame, Eq. 1. Shape (..., D) [m], or (..., 7) for poses."""
        points = np.asarray(points, dtype=float)
        if points.shape[-1] == self.n_dims:
            return (points - self.b) @ self.A  # A^-1 = A^T
        turned = quat_product(self.quat_wxyz * (1.0, -1.0, -1.0, -1.0), points[..., self.n_dims :])
        return np.concatenate([(points[..., : self.n_dims] - self.b) @ self.A, turned], axis=-1)

    def to_world(self, points: Array) -> Array:
        """Points of this frame seen from the world, Eq. 8. Shape (..., D) [m], or (..., 7) for poses."""
        points = np.asarray(points, dtype=float)
        if points.shape[-1] == self.n_dims:
            return points @ self.A.T + self.b
        turned = quat_product(self.quat_wxyz, points[..., self.n_dims :])
        return np.concatenate([points[..., : self.n_dims] @ self.A.T + self.b, turned], axis=-1)

    def tangent_to_world(self, n_tangent: int) -> Array:
        """What turns tangents of this frame into those of the world. Shape (T, T)."""
        turn = np.eye(n_tangent)
        turn[: self.n_dims, : self.n_dims] = self.A
        return turn

    def covariance_to_world(self, covariances: Array) -> Array:
        """Covariances of this frame seen from the world, Eq. 8. Shape (..., T, T) [m, rad]."""
        covariances = np.asarray(covariances, dtype=float)
        turn = self.tangent_to_world(covariances.shape[-1])
        return turn @ covariances @ turn.T


def quat_product(a: Array, b: Array) -> Array:
    """The rotation b, then a. Shapes (..., 4), scalar first."""
    w, x, y, z = np.moveaxis(np.asarray(a, dtype=float), -1, 0)
    q0, q1, q2, q3 = np.moveaxis(np.asarray(b, dtype=float), -1, 0)
    return np.stack(
        [
            w * q0 - x * q1 - y * q2 - z * q3,
            w * q1 + x * q0 + y * q3 - z * q2,
            w * q2 - x * q3 + y * q0 + z * q1,
            w * q3 + x * q2 - y * q1 + z * q0,
        ],
        axis=-1,
    )
