"""DP-means: every datapoint to the nearest component, or to a new one (Algorithm 1, spatial part).

The count form of Algorithm 1: a component's mean is the running mean of its datapoints, its covariance
the minimum covariance plus their scatter divided by their number. Each datapoint carries more than its
position, and the same update serves the whole vector

    y = [ x, w_u lambda u, w_sigma sigma, elapsed, s ]        per frame, length 3 D + 2,

with u the unit direction of travel, sigma the distance travelled since the start of the demonstration,
*elapsed* the time since the component was entered and s the start of the demonstration. Its first
2 D + 1 numbers decide the assignment; elapsed and s feed the regressions of the ramp reference and of
the start, which are extensions of the paper.

Before the hand has travelled a little it has no direction. Such a datapoint is compared without one and
takes that of its component; a component which was founded by such datapoints takes that of the first
datapoint that has one. Without this every demonstration would begin with a component of a single point.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Distance over which the direction of travel is averaged, as a fraction of lambda.
_DIRECTION_LENGTH = 0.1


class Clusters(NamedTuple):
    """Sufficient statistics of the components; arrays have room for more than `size` of them."""

    size: Integers  # K, shape (1,)
    counts: Integers  # n_i, shape (capacity,)
    terminal: NDArray[np.bool_]  # shape (capacity,)
    means: Array  # of y, shape (capacity, P, 3 D + 2)
    scatters: Array  # of y about its mean, shape (capacity, P, 3 D + 2, 3 D + 2)

    @classmethod
    def empty(cls, capacity: int, n_frames: int, n_dims: int) -> Clusters:
        """No component yet."""
        y = 3 * n_dims + 2
        return cls(
            np.zeros(1, np.int64),
            np.zeros(capacity, np.int64),
            np.zeros(capacity, np.bool_),
            np.zeros((capacity, n_frames, y)),
            np.zeros((capacity, n_frames, y, y)),
        )


class Motion(NamedTuple):
    """What is remembered of the running demonstration: a few vectors, never its datapoints."""

    component: Integers  # q_{t-1}, or -1 before the first datapoint; shape (1,)
    clock: Array  # time of the last datapoint, and when its component was entered [s]; shape (2,)
    position: Array  # last datapoint in each frame [m], shape (P, D)
    direction: Array  # steps averaged over a short travelled distance, shape (P, D)
    travelled: Array  # sigma [m], shape (P,)
    start: Array  # s [m], shape (P, D)

    @classmethod
    def begin(cls, n_frames: int, n_dims: int) -> Motion:
        """Before the first datapoint."""
        frame = (n_frames, n_dims)
        zeros = np.zeros
        return cls(np.array([-1]), zeros(2), zeros(frame), zeros(frame), zeros(n_frames), zeros(frame))


@njit(cache=True, error_model="numpy")
def assign_points(clusters, motion, points, times, max_distance, weights, hysteresis, labels):
    """Learn from datapoints in their order, until one needs a component for which there is no room.

    Args:
        clusters: Changed in place.
        motion: Changed in place.
        points: Datapoints in each frame [m]. Shape (T, P, D).
        times: Their times [s]. Shape (T,).
        max_distance: The lambda [m].
        weights: Weights w_u and w_sigma of direction and travelled distance in the assignment.
        hysteresis: A switch must be nearer by this fraction of lambda.
        labels: Components of the datapoints, written. Shape (T,).

    Returns:
        How many datapoints were taken in.
    """
    y = np.empty(clusters.means.shape[1:])
    for t in range(points.shape[0]):
        if clusters.size[0] == clusters.counts.size:
            return t
        previous = motion.component[0]
        _travel(motion, points[t], times[t], max_distance)
        _describe(y, motion, max_distance, weights)
        q = _nearest(clusters, y, points.shape[2], previous, max_distance, hysteresis)
        if q < 0:
            q = _new_component(clusters)
        if q != previous:
            motion.component[0] = q
            motion.clock[1] = motion.clock[0]  # a datapoint owns the interval that it ends
        y[:, 2 * points.shape[2] + 1] = times[t] - motion.clock[1]
        _share_direction(clusters.means[q], y, points.shape[2])
        _update(clusters, q, y)
        motion.clock[0] = times[t]
        labels[t] = q
    return points.shape[0]


@njit(cache=True, error_model="numpy")
def add_end(clusters, motion, max_distance, weights):
    """Take the last datapoint into a terminal component, the nearest or a new one; return which."""
    n_dims = motion.position.shape[1]
    y = np.empty(clusters.means.shape[1:])
    _describe(y, motion, max_distance, weights)
    y[:, 2 * n_dims + 1] = 0.0
    best, best_distance = -1, max_distance
    for i in range(clusters.size[0]):
        if clusters.terminal[i]:
            distance = _distance(clusters.means[i], y, n_dims)
            if distance <= best_distance:
                best, best_distance = i, distance
    if best < 0:
        best = _new_component(clusters)
        clusters.terminal[best] = True
    _update(clusters, best, y)
    return best


@njit(cache=True, error_model="numpy")
def _travel(motion, point, time, max_distance):
    """Move to the next datapoint: distance and direction depend on the path, not on its timing."""
    if motion.component[0] < 0:
        motion.start[:] = point
        motion.position[:] = point
        motion.clock[:] = time
        return
    for p in range(point.shape[0]):
        square = 0.0
        for k in range(point.shape[1]):
            square += (point[p, k] - motion.position[p, k]) ** 2
        if square > 0.0:
            length = np.sqrt(square)
            forget = np.exp(-length / (_DIRECTION_LENGTH * max_distance))
            for k in range(point.shape[1]):
                unit = (point[p, k] - motion.position[p, k]) / length
                motion.direction[p, k] = forget * motion.direction[p, k] + (1.0 - forget) * unit
            motion.travelled[p] += length
    motion.position[:] = point


@njit(cache=True, error_model="numpy")
def _describe(y, motion, max_distance, weights):
    """The vector y of the present datapoint, but for the elapsed time."""
    n_dims = motion.position.shape[1]
    for p in range(y.shape[0]):
        square = 0.0
        for k in range(n_dims):
            square += motion.direction[p, k] ** 2
        known = square > 0.0 and motion.travelled[p] >= _DIRECTION_LENGTH * max_distance
        scale = weights[0] * max_distance / np.sqrt(square) if known else 0.0
        for k in range(n_dims):
            y[p, k] = motion.position[p, k]
            y[p, n_dims + k] = scale * motion.direction[p, k]
            y[p, 2 * n_dims + 2 + k] = motion.start[p, k]
        y[p, 2 * n_dims] = weights[1] * motion.travelled[p]


@njit(cache=True, error_model="numpy")
def _nearest(clusters, y, n_dims, previous, max_distance, hysteresis):
    """Nearest component that is not terminal, with hysteresis; -1 when all are beyond lambda."""
    best, best_distance = -1, np.inf
    stay_distance = np.inf
    for i in range(clusters.size[0]):
        if clusters.terminal[i]:
            continue
        distance = _assignment_distance(clusters.means[i], y, n_dims)
        if i == previous:
            stay_distance = distance
        if distance < best_distance:
            best, best_distance = i, distance
    if stay_distance <= max_distance and stay_distance - best_distance < hysteresis * max_distance:
        return previous
    return best if best_distance <= max_distance else -1


@njit(cache=True, error_model="numpy")
def _has_direction(vector, n_dims):
    for k in range(n_dims, 2 * n_dims):  # noqa: SIM110 (numba cannot compile a generator)
        if vector[k] != 0.0:
            return True
    return False


@njit(cache=True, error_model="numpy")
def _assignment_distance(mean, y, n_dims):
    """Distance in position, direction where both have one, and distance travelled."""
    total = 0.0
    for p in range(y.shape[0]):
        directed = _has_direction(y[p], n_dims) and _has_direction(mean[p], n_dims)
        for k in range(2 * n_dims + 1):
            if directed or k < n_dims or k == 2 * n_dims:
                total += (y[p, k] - mean[p, k]) ** 2
    return np.sqrt(total / y.shape[0])


@njit(cache=True, error_model="numpy")
def _share_direction(mean, y, n_dims):
    """Let the one that has no direction yet take that of the other."""
    for p in range(y.shape[0]):
        source, target = (y, mean) if not _has_direction(mean[p], n_dims) else (mean, y)
        if not _has_direction(target[p], n_dims):
            target[p, n_dims : 2 * n_dims] = source[p, n_dims : 2 * n_dims]


@njit(cache=True, error_model="numpy")
def _distance(mean, y, n_numbers):
    """Root mean square over the frames of the Euclidean distance, so that lambda stays in metres."""
    total = 0.0
    for p in range(y.shape[0]):
        for k in range(n_numbers):
            total += (y[p, k] - mean[p, k]) ** 2
    return np.sqrt(total / y.shape[0])


@njit(cache=True, error_model="numpy")
def _new_component(clusters):
    k = clusters.size[0]
    clusters.size[0] = k + 1
    return k


@njit(cache=True, error_model="numpy")
def _update(clusters, q, y):
    """Running mean and scatter: n += 1, S += (n-1)/n e e^T, mu += e/n."""
    clusters.counts[q] += 1
    n = clusters.counts[q]
    share = (n - 1) / n
    for p in range(y.shape[0]):
        mean, scatter = clusters.means[q, p], clusters.scatters[q, p]
        for k in range(mean.size):
            e_k = y[p, k] - mean[k]
            for m in range(k, mean.size):  # mean[m] is still the old one
                scatter[k, m] += share * e_k * (y[p, m] - mean[m])
                scatter[m, k] = scatter[k, m]
            mean[k] += e_k / n
