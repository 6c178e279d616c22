"""DP-means: every datapoint to the nearest component, or to a new one (Algorithm 1, spatial part).

Direction and distance travelled decide with the point, so that paths that cross themselves or return are
kept apart, and orientation, a radian of which is worth w_r lambda. A datapoint without a direction is
compared without one and takes that of its component; a component which was founded by such datapoints
takes that of the first datapoint that has one. Without this every demonstration would begin with a
component of a single point.
"""

from __future__ import annotations

import numpy as np

from common.kernel import kernel
from local_site.learning.clusters import new_component, update
from local_site.learning.motion import describe, travel


@kernel
def assign_points(clusters, motion, points, times, max_distance, weights, hysteresis, labels):
    """Learn from datapoints in their order, until one needs a component for which there is no room.

    Args:
        clusters: Changed in place.
        motion: Changed in place.
        points: Datapoints in each frame. Shape (T, P, C).
        times: Their times [s]. Shape (T,).
        max_distance: The lambda [m].
        weights: Weights w_u, w_sigma, w_r of direction, travelled distance and rotation in the assignment.
        hysteresis: A switch must be nearer by this fraction of lambda.
        labels: Components of the datapoints, written. Shape (T,).

    Returns:
        How many datapoints were taken in.
    """
    C, T = points.shape[2], motion.direction.shape[1]
    means, terminal = clusters.means, clusters.terminal
    y, e = np.empty(clusters.means.shape[1:]), np.empty(clusters.scatters.shape[2])
    for t in range(points.shape[0]):
        if clusters.size[0] == clusters.counts.size:
            return t
        previous = motion.component[0]
        travel(motion, points[t], times[t], max_distance, weights[2], e[:T])
        describe(y, motion, max_distance, weights)
        K = clusters.size[0]
        q = _nearest(means, terminal, K, y, C, T, previous, max_distance, weights[2], hysteresis)
        if q < 0:
            q = new_component(clusters)
        if q != previous:
            motion.component[0] = q
            motion.clock[1] = motion.clock[0]  # a datapoint owns the interval that it ends
        y[:, 2 * C] = times[t] - motion.clock[1]
        _share_direction(clusters.means, q, y, C, T)
        update(clusters, q, y, C, T, e)
        motion.clock[0] = times[t]
        labels[t] = q
    return points.shape[0]


@kernel
def add_end(clusters, motion, max_distance, weights):
    """Take the last datapoint into a terminal component, the nearest or a new one; return which."""
    C, T = motion.point.shape[1], motion.direction.shape[1]
    y, e = np.empty(clusters.means.shape[1:]), np.empty(clusters.scatters.shape[2])
    describe(y, motion, max_distance, weights)
    y[:, 2 * C] = 0.0
    best, least = -1, y.shape[0] * max_distance**2
    for i in range(clusters.size[0]):
        if clusters.terminal[i]:
            total = _position_squares(clusters.means, i, y, C if C == T else C - 4)
            total += _rotation_squares(clusters.means, i, y, C, T, weights[2] * max_distance)
            if total <= least:
                best, least = i, total
    if best < 0:
        best = new_component(clusters)
        clusters.terminal[best] = True
    update(clusters, best, y, C, T, e)
    return best


@kernel
def _nearest(means, terminal, K, y, C, T, previous, max_distance, w_r, hysteresis):
    """Nearest component that is not terminal, with hysteresis; -1 when all are beyond lambda.

    A distance is the mean over the frames, so that lambda stays in metres. Most components are out of
    question by their position alone.
    """
    radian, P, n_dims = w_r * max_distance, y.shape[0], C if C == T else C - 4
    best, least, stay = -1, np.inf, np.inf
    if previous >= 0:
        stay = _position_squares(means, previous, y, n_dims) + _other_squares(
            means, previous, y, C, T, radian
        )
        best, least = previous, stay
    for i in range(K):
        total = 0.0  # `_position_squares`, written out: a call takes longer than the work
        for p in range(P):
            for k in range(n_dims):
                difference = y[p, k] - means[i, p, k]
                total += difference * difference
        if total < least and not terminal[i] and i != previous:
            total += _other_squares(means, i, y, C, T, radian)
            if total < least:
                best, least = i, total
    stay, nearest = np.sqrt(stay / P), np.sqrt(least / P)
    if stay <= max_distance and stay - nearest < hysteresis * max_distance:
        return previous
    return best if nearest <= max_distance else -1


@kernel
def _position_squares(means, i, y, n_dims):
    """Squared distance of the positions, summed over the frames."""
    total = 0.0
    for p in range(y.shape[0]):
        for k in range(n_dims):
            total += (y[p, k] - means[i, p, k]) ** 2
    return total


@kernel
def _rotation_squares(means, i, y, C, T, metres_per_radian):
    """Squared angle between the orientations, in metres, summed over the frames."""
    total = 0.0
    for p in range(y.shape[0] if C > T else 0):
        cosine = 0.0
        for k in range(C - 4, C):
            cosine += y[p, k] * means[i, p, k]
        total += (metres_per_radian * 2.0 * np.arccos(min(abs(cosine), 1.0))) ** 2
    return total


@kernel
def _other_squares(means, i, y, C, T, metres_per_radian):
    """Squared distance in rotation, distance travelled, and direction where both have one, summed likewise."""
    total, first = _rotation_squares(means, i, y, C, T, metres_per_radian), 2 * C + 1
    for p in range(y.shape[0]):
        total += (y[p, first + T] - means[i, p, first + T]) ** 2
        square = mine = theirs = 0.0
        for k in range(first, first + T):
            square += (y[p, k] - means[i, p, k]) ** 2
            mine += abs(y[p, k])
            theirs += abs(means[i, p, k])
        if mine > 0.0 and theirs > 0.0:
            total += square
    return total


@kernel
def _share_direction(means, q, y, C, T):
    """Let the one that has no direction yet take that of the other."""
    first = 2 * C + 1
    for p in range(y.shape[0]):
        mine = theirs = 0.0
        for k in range(first, first + T):
            mine += abs(y[p, k])
            theirs += abs(means[q, p, k])
        for k in range(first, first + T):
            if theirs == 0.0:
                means[q, p, k] = y[p, k]
            elif mine == 0.0:
                y[p, k] = means[q, p, k]
