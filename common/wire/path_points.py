"""Points of a planned path as bytes: positions in single precision, poses in half precision.

A pose has seven numbers, and a narrow link carries a few hundred bytes a second. Half precision gives 1 mm
and 0.1 degrees within 2 m of the task frame, which suffices for drawing and viewing.
"""

from __future__ import annotations

import numpy as np
from msgspec import structs
from numpy.typing import ArrayLike, NDArray

from farhand.common.errors import InvalidMessage
from farhand.common.model.manifold import POSE
from farhand.common.wire.messages import PlannedPath

Array = NDArray[np.float64]


def packed(points: ArrayLike) -> bytes:
    """Encode points of shape (N, C) as bytes."""
    points = np.asarray(points, dtype=float)
    return points.astype(_dtype(points.shape[1])).tobytes()


def points_of(path: PlannedPath) -> Array:
    """Return the points of a path in the task frame; quaternions of unit length. Shape (N, C).

    Raises:
        InvalidMessage: When the bytes are not a whole number of points.
    """
    dtype = _dtype(path.n_coordinates)
    if len(path.points) % (dtype.itemsize * path.n_coordinates):
        raise InvalidMessage("path", "points", f"whole points of {path.n_coordinates} numbers")
    points = np.frombuffer(path.points, dtype).reshape(-1, path.n_coordinates).astype(float)
    if path.n_coordinates == POSE.n_coordinates:
        points[:, 3:] /= np.linalg.norm(points[:, 3:], axis=1, keepdims=True)
    return points


def thinned(path: PlannedPath, max_bytes: int) -> PlannedPath:
    """Lengthen the steps of a path until its points fit into a number of bytes.

    The last point stays the last, at the end of a whole step: up to a step later than before.

    Args:
        path: Path in steps that are short enough to draw.
        max_bytes: Size for two points or more.
    """
    size = path.n_coordinates * _dtype(path.n_coordinates).itemsize
    n = len(path.points) // size
    if len(path.points) <= max_bytes:
        return path
    every = -(-(n - 1) // (max_bytes // size - 1))
    kept = [*range(0, n - 1, every), n - 1]
    points = b"".join(path.points[k * size : (k + 1) * size] for k in kept)
    return structs.replace(path, step_s=every * path.step_s, points=points)


def duration_s(path: PlannedPath) -> float:
    """Return the time from the first point to the last [s]."""
    n = len(path.points) // (_dtype(path.n_coordinates).itemsize * path.n_coordinates)
    return max(n - 1, 0) * path.step_s


def _dtype(n_coordinates: int) -> np.dtype:
    return np.dtype("<f2" if n_coordinates == POSE.n_coordinates else "<f4")
