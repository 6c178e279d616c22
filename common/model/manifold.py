"""The spaces a motion lives in: positions of the plane and of space, and poses R3 x S3.

A point of a space of positions has D coordinates. A *pose* has seven: position and unit quaternion
(x, y, z, qw, qx, qy, qz), where q and -q are the same orientation. Differences, velocities, slopes and
covariances live in the tangent space, which for positions has D numbers and for a pose six:

    [ position in the axes of the frame, rotation vector in the axes of the body ]        [m, rad]

so that ``exp(x, t) = (p + t_p, q Exp(t_r))`` and ``log`` is its inverse, with the rotation of at most half
a turn. Body axes make the rotational part the same in every task frame. For positions log is a difference
and exp a sum: one code path serves all spaces.

    EUCLIDEAN: Manifold(2), Manifold(3)      POSE = Manifold(3, oriented=True)

The kernels `log_at` and `exp_at` tell the spaces apart by the lengths of their arguments: as many
coordinates as tangent numbers, or one more for a pose.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from farhand.common.errors import InvalidInput
from farhand.common.model.kernel import kernel, plain_kernel

Array = NDArray[np.float64]

# A quaternion further from unit length than this was not meant as an orientation.
UNIT_TOLERANCE = 1e-3
# Below this angle [rad] series replace quotients.
_SMALL = 1e-4


@dataclass(frozen=True)
class Manifold:
    """Space of positions, or of poses.

    Args:
        n_dims: Dimension D of positions and of the task frames.
        oriented: Whether a point carries an orientation too; then D is 3.

    Raises:
        InvalidInput: For orientations in another dimension than three.
    """

    n_dims: int
    oriented: bool = False

    def __post_init__(self) -> None:
        if self.oriented and self.n_dims != 3:
            raise InvalidInput("manifold", "n_dims", f"3 for poses, got {self.n_dims}")

    @classmethod
    def of(cls, n_coordinates: int, n_tangent: int) -> Manifold:
        """Return the space with these numbers of coordinates and tangent numbers.

        Raises:
            InvalidInput: When there is none.
        """
        if n_coordinates == n_tangent:
            return cls(n_tangent)
        if (n_coordinates, n_tangent) == (7, 6):
            return POSE
        raise InvalidInput(
            "manifold", "", f"D and D numbers, or 7 and 6, got {n_coordinates} and {n_tangent}"
        )

    @property
    def n_coordinates(self) -> int:
        """Number of coordinates of a point."""
        return self.n_dims + 4 * self.oriented

    @property
    def n_tangent(self) -> int:
        """Number of coordinates of a difference, a velocity or a side of a covariance."""
        return self.n_dims + 3 * self.oriented

    @property
    def parts(self) -> tuple[slice, ...]:
        """The tangent numbers that share a unit: positions [m], and for poses rotations [rad]."""
        return (slice(0, self.n_dims), slice(self.n_dims, None))[: 1 + self.oriented]

    def checked(self, points: ArrayLike, source: str, field: str) -> Array:
        """Return finite points with unit quaternions, as a new array. Shape (..., C).

        Raises:
            InvalidInput: When the last axis is wrong, a number is not finite, or the quaternion of a pose
                is not of unit length; a deviation of rounding is mended.
        """
        array = np.array(points, dtype=float, order="C")
        if array.ndim == 0 or array.shape[-1] != self.n_coordinates:
            raise InvalidInput(source, field, f"{self._coordinates()}, got shape {array.shape}")
        finite, unit = _checked(array.reshape(-1, self.n_coordinates), self.n_dims)
        if not finite:
            raise InvalidInput(source, field, "finite numbers only")
        if not unit:
            raise InvalidInput(source, field, "unit quaternions (w, x, y, z) after the position")
        return array

    def log(self, base: ArrayLike, point: ArrayLike) -> Array:
        """Return the tangents that lead from the bases to the points. Shape (..., T)."""
        both = np.broadcast_arrays(np.asarray(base, dtype=float), np.asarray(point, dtype=float))
        a, b = (np.array(array) for array in both)  # what was broadcast must not be given to a kernel
        out = np.empty((*a.shape[:-1], self.n_tangent))
        _log_all(_rows(a), _rows(b), out.reshape(-1, self.n_tangent))
        return out

    def exp(self, base: ArrayLike, tangent: ArrayLike) -> Array:
        """Return the points that the tangents lead to from the bases. Shape (..., C)."""
        base, tangent = np.asarray(base, dtype=float), np.asarray(tangent, dtype=float)
        shape = np.broadcast_shapes(base.shape[:-1], tangent.shape[:-1])
        a = np.broadcast_to(base, (*shape, self.n_coordinates))
        t = np.broadcast_to(tangent, (*shape, self.n_tangent))
        out = np.empty(a.shape)
        _exp_all(_rows(a), _rows(t), out.reshape(-1, self.n_coordinates))
        return out

    def jacobian(self, tangent: ArrayLike) -> Array:
        """Return the derivative of exp(x, tangent), in its own axes, with respect to the tangent.

        Shape (..., T, T).

        ``log(exp(x, t), exp(x, t + d)) = J(t) d`` to first order in d: the identity for positions, the
        right Jacobian of the rotation group for orientations.
        """
        tangent = np.asarray(tangent, dtype=float)
        J = np.broadcast_to(np.eye(self.n_tangent), (*tangent.shape, self.n_tangent)).copy()
        if self.oriented:
            for index in np.ndindex(tangent.shape[:-1]):
                right_jacobian(tangent[index][3:], J[index][3:, 3:])
        return J

    def distance(self, a: ArrayLike, b: ArrayLike, metres_per_radian: float) -> Array:
        """Return the length of the difference, with a weight of a radian in metres. Shape (...) [m]."""
        tangent = self.log(a, b)
        tangent[..., self.n_dims :] *= metres_per_radian
        return np.linalg.norm(tangent, axis=-1)

    def _coordinates(self) -> str:
        if self.oriented:
            return "7 numbers (x, y, z, qw, qx, qy, qz) for each pose"
        return f"{self.n_dims} numbers for each position"


POSE = Manifold(3, oriented=True)


def _rows(array: Array) -> Array:
    return np.ascontiguousarray(array).reshape(-1, array.shape[-1])


@kernel
def _checked(points, n_dims):
    """Check that all numbers are finite and all quaternions of unit length; mend rounding errors."""
    unit = True
    for row in range(points.shape[0]):
        for k in range(points.shape[1]):
            if not np.isfinite(points[row, k]):
                return False, unit
        if points.shape[1] == n_dims:
            continue
        w, x, y, z = points[row, 3], points[row, 4], points[row, 5], points[row, 6]
        norm = np.sqrt(w * w + x * x + y * y + z * z)
        unit = unit and abs(norm - 1.0) <= UNIT_TOLERANCE
        for k in range(n_dims, n_dims + 4):
            points[row, k] /= norm
    return True, unit


@plain_kernel
def copy_to(values, out):
    """Write values to out, element by element: an assignment of arrays asks for memory. Shapes (C,), (C,)."""
    for k in range(out.size):
        out[k] = values[k]


@plain_kernel
def log_at(base, point, out):
    """Write log(base, point) to out. Shapes (C,), (C,), (T,)."""
    n = out.size if base.size == out.size else base.size - 4
    for k in range(n):
        out[k] = point[k] - base[k]
    if base.size == n:
        return
    a, b, c, d = base[n], base[n + 1], base[n + 2], base[n + 3]
    w, x, y, z = point[n], point[n + 1], point[n + 2], point[n + 3]
    real = a * w + b * x + c * y + d * z  # base^-1 point
    i = a * x - b * w - c * z + d * y
    j = a * y + b * z - c * w - d * x
    k = a * z - b * y + c * x - d * w
    sine = np.sqrt(i * i + j * j + k * k)
    sign = 1.0 if real >= 0.0 else -1.0  # q and -q are one orientation
    if sine < _SMALL:
        scale = sign * 2.0 / np.sqrt(real * real + sine * sine)
    else:
        scale = sign * 2.0 * np.arctan2(sine, abs(real)) / sine
    out[n], out[n + 1], out[n + 2] = scale * i, scale * j, scale * k


@plain_kernel
def exp_at(base, tangent, out):
    """Write exp(base, tangent), with a unit quaternion, to out, which may be base.

    Shapes (C,), (T,), (C,).
    """
    n = tangent.size if base.size == tangent.size else base.size - 4
    for k in range(n):
        out[k] = base[k] + tangent[k]
    if base.size == n:
        return
    x, y, z = tangent[n], tangent[n + 1], tangent[n + 2]
    angle = np.sqrt(x * x + y * y + z * z)
    w = np.cos(0.5 * angle)
    scale = np.sin(0.5 * angle) / angle if angle > _SMALL else 0.5 - angle * angle / 48.0
    x, y, z = scale * x, scale * y, scale * z
    a, b, c, d = base[n], base[n + 1], base[n + 2], base[n + 3]
    q0 = a * w - b * x - c * y - d * z
    q1 = a * x + b * w + c * z - d * y
    q2 = a * y - b * z + c * w + d * x
    q3 = a * z + b * y - c * x + d * w
    norm = np.sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    out[n], out[n + 1], out[n + 2], out[n + 3] = q0 / norm, q1 / norm, q2 / norm, q3 / norm


@kernel
def right_jacobian(v, out):
    """Write I - (1 - cos a)/a^2 [v] + (a - sin a)/a^3 [v]^2 with a = |v| to out. Shapes (3,), (3, 3)."""
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    if square > _SMALL:  # of the square, since the quotients lose more digits
        angle = np.sqrt(square)
        _polynomial(
            v, square, (np.cos(angle) - 1.0) / square, (angle - np.sin(angle)) / (square * angle), out
        )
    else:
        _polynomial(v, square, square / 24.0 - 0.5, 1.0 / 6.0 - square / 120.0, out)


@kernel
def inverse_right_jacobian(v, out):
    """Write I + [v]/2 + (1 - (a/2) cot(a/2))/a^2 [v]^2 with a = |v| to out. Shapes (3,), (3, 3)."""
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    if square > _SMALL:
        half = 0.5 * np.sqrt(square)
        _polynomial(v, square, 0.5, (1.0 - half * np.cos(half) / np.sin(half)) / square, out)
    else:
        _polynomial(v, square, 0.5, 1.0 / 12.0 + square / 720.0, out)


@kernel
def _polynomial(v, square, first, second, out):
    """Write I + first [v] + second [v]^2 to out, where [v] w = v x w."""
    for r in range(3):
        for c in range(3):
            out[r, c] = second * v[r] * v[c]
        out[r, r] += 1.0 - second * square
    out[0, 1] -= first * v[2]
    out[0, 2] += first * v[1]
    out[1, 0] += first * v[2]
    out[1, 2] -= first * v[0]
    out[2, 0] -= first * v[1]
    out[2, 1] += first * v[0]


@kernel
def _log_all(base, point, out):
    for row in range(out.shape[0]):
        log_at(base[row], point[row], out[row])


@kernel
def _exp_all(base, tangent, out):
    for row in range(out.shape[0]):
        exp_at(base[row], tangent[row], out[row])
