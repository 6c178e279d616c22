"""Task parameters {A, b}: a coordinate system seen by the robot (Eqs. 1 and 8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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

    def to_local(self, points: Array) -> Array:
        """Points of the world seen from this frame, Eq. 1. Shape (..., D) [m]."""
        return (np.asarray(points, dtype=float) - self.b) @ self.A  # A^-1 = A^T

    def to_world(self, points: Array) -> Array:
        """Points of this frame seen from the world, Eq. 8. Shape (..., D) [m]."""
        return np.asarray(points, dtype=float) @ self.A.T + self.b

    def covariance_to_world(self, covariances: Array) -> Array:
        """Covariances of this frame seen from the world, Eq. 8. Shape (..., D, D) [m^2]."""
        return self.A @ np.asarray(covariances, dtype=float) @ self.A.T
