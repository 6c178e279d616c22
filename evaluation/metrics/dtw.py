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


def warping_path(one: Array, other: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices of the points that dynamic time warping puts beside each other, from first to last."""
    cost = _costs(np.ascontiguousarray(one), np.ascontiguousarray(other))
    i, j = len(one), len(other)
    pairs = []
    while i > 0:  # the first row and column are infinite but for their corner
        pairs.append((i - 1, j - 1))
        i, j = min([(i - 1, j - 1), (i - 1, j), (i, j - 1)], key=lambda at: cost[at])
    ours, theirs = np.array(pairs[::-1]).T
    return ours, theirs


@njit(cache=True)
def _costs(a, b):
    """Least sum of squared distances up to each pair of points. Shape (n + 1, m + 1)."""
    cost = np.full((a.shape[0] + 1, b.shape[0] + 1), np.inf)
    cost[0, 0] = 0.0
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            best = min(cost[i, j], cost[i, j + 1], cost[i + 1, j])
            cost[i + 1, j + 1] = best + np.sum((a[i] - b[j]) ** 2)
    return cost


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
