"""Distance between two motions, whatever their timing: dynamic time warping."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


def resampled_by_length(points: Array, n_points: int = 200) -> Array:
    """Points equally far apart along a path, its first and last among them. Shape (n_points, D)."""
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    at = np.linspace(0.0, travelled[-1], n_points)
    return np.stack([np.interp(at, travelled, axis) for axis in points.T], axis=1)


def dtw_rms(one: Array, other: Array) -> float:
    """Root mean square of the distances along the warping path of two resampled motions [m]."""
    squares, steps = _warp(resampled_by_length(one), resampled_by_length(other))
    return float(np.sqrt(squares / steps))


@njit(cache=True)
def _warp(a, b):
    """Least sum of squared distances over warping paths, and the length of the path that has it."""
    n, m = a.shape[0], b.shape[0]
    cost, length = np.full((n + 1, m + 1), np.inf), np.zeros((n + 1, m + 1))
    cost[0, 0] = 0.0
    for i in range(n):
        for j in range(m):
            best, steps = cost[i, j], length[i, j]  # both move on
            if cost[i, j + 1] < best:
                best, steps = cost[i, j + 1], length[i, j + 1]
            if cost[i + 1, j] < best:
                best, steps = cost[i + 1, j], length[i + 1, j]
            cost[i + 1, j + 1] = best + np.sum((a[i] - b[j]) ** 2)
            length[i + 1, j + 1] = steps + 1.0
    return cost[n, m], length[n, m]
