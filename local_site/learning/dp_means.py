"""DP-means: every datapoint to the nearest component, or to a new one (Algorithm 1, spatial part).

Direction and distance travelled decide with the point, so that paths that cross themselves or return are
kept apart, and orientation, a radian of which is worth w_r lambda. A datapoint without a direction is
compared without one and takes that of its component; a component which was founded by such datapoints
takes that of the first datapoint that has one. Without this every demonstration would begin with a
component of a single point.

With several task frames every frame has its own distance, and a rule makes one of them, in metres:

    "all"        the mean square over the frames
    "goal"       that of the last frame
    "nearest"    the least
    "relevant"   the mean square weighted by the precisions of the component's positions in the frames, so
                 that a frame in which it is spread out hardly counts
"""

from __future__ import annotations

import numpy as np

from farhand.common.model.kernel import kernel, plain_kernel
from farhand.local_site.learning.clusters import new_component, update
from farhand.local_site.learning.ending import ended_at
from farhand.local_site.learning.motion import describe, travel
from farhand.local_site.learning.sketch import draw_point

FRAME_RULES = ("all", "goal", "nearest", "relevant")
_ALL, _GOAL, _NEAREST, _RELEVANT = range(len(FRAME_RULES))
# A component counts as spread out by at least this fraction of lambda, so that no frame decides too early.
_LEAST_SPREAD = 0.1


@kernel
def assign_points(clusters, motion, points, times, max_distance, weights, hysteresis, rule, labels, rests):
    """Learn from datapoints in their order, until one needs a component for which there is no room.

    While the hand rests a component learns nothing, and its clock stands still: a pause is not worth more than what
    other demonstrations have shown.

    Args:
        clusters: Changed in place.
        motion: Changed in place.
        points: Datapoints in each frame. Shape (T, P, C).
        times: Their times [s]. Shape (T,).
        max_distance: The lambda [m].
        weights: Weights w_u, w_sigma, w_r of direction, travelled distance and rotation in the assignment.
        hysteresis: A switch must be nearer by this fraction of lambda.
        rule: Number of the rule among `FRAME_RULES`.
        labels: Components of the datapoints, written. Shape (T,).
        rests: Whether the hand rested before each datapoint, written. Shape (T,).

    Returns:
        How many datapoints were taken in.
    """
    squares, y = np.empty((2, clusters.counts.size)), np.empty(clusters.means.shape[1:])
    room = (squares, y, np.empty(clusters.scatters.shape[2]))
    for t in range(points.shape[0]):
        if clusters.counts.size == clusters.size[0]:
            return t
        labels[t] = _assign(
            clusters,
            motion,
            points[t],
            times[t],
            max_distance,
            weights,
            hysteresis,
            rule,
            rests[t : t + 1],
            room,
        )
    return points.shape[0]


@plain_kernel
def _assign(clusters, motion, point, time, max_distance, weights, hysteresis, rule, rests, room):
    """Learn from a datapoint, and return its component."""
    squares, y, e = room
    K, C, T = clusters.size[0], point.shape[1], motion.direction.shape[1]
    previous, radian = motion.component[0], weights[2] * max_distance
    rests[0] = travel(motion, point, time, max_distance, weights[2], e[:T])
    draw_point(motion.sketch, point, time, max_distance, radian, motion.ending.noise[-1], e[:T])
    describe(y, motion, max_distance, weights)
    q = _nearest(clusters, K, y, C, T, previous, max_distance, radian, hysteresis, rule, squares)
    if q < 0:
        q = new_component(clusters)
    if q != previous:
        motion.component[0] = q
        motion.clock[1] = motion.clock[0]  # a datapoint owns the interval that it ends
        motion.clock[3] = 0.0
    if rests[0]:
        motion.clock[3] += time - motion.clock[0]
    for p in range(y.shape[0]):
        y[p, 2 * C] = time - motion.clock[1] - motion.clock[3]
    if not rests[0] or clusters.counts[q] == 0:
        _share_direction(clusters.means, q, y, C, T)
        update(clusters, q, y, C, T, e)
    if rule == _RELEVANT or q != previous:
        _weigh_frames(clusters, q, C if C == T else C - 4, max_distance, rule)
    motion.clock[0] = time
    return q


@kernel
def add_end(clusters, motion, max_distance, weights, rule):
    """Take where the motion ended into a terminal component, the nearest or a new one; return which.

    Where a motion ends is for the goal's frame to say, which is the last one.
    """
    C, T = motion.point.shape[1], motion.direction.shape[1]
    y, e = np.empty(clusters.means.shape[1:]), np.empty(clusters.scatters.shape[2])
    describe(y, motion, max_distance, weights)
    y[:, 2 * C] = 0.0
    for p in range(y.shape[0]):
        ended_at(motion.ending, p, motion.point[p], e[:T], y[p, :C])
        motion.point[p] = y[p, :C]
    best, least = -1, max_distance**2
    for i in range(clusters.size[0]):
        if clusters.terminal[i]:
            square = _point_square(clusters.means, i, y.shape[0] - 1, y, C, T, weights[2] * max_distance)
            if square <= least:
                best, least = i, square
    if best < 0:
        best = new_component(clusters)
        clusters.terminal[best] = True
    update(clusters, best, y, C, T, e)
    _weigh_frames(clusters, best, C if C == T else C - 4, max_distance, rule)
    return best


@plain_kernel
def _nearest(clusters, K, y, C, T, previous, max_distance, radian, hysteresis, rule, squares):
    """Return the nearest component that is not terminal, with hysteresis; -1 when all are beyond lambda.

    Most components are excluded by their position alone.
    """
    means, shares, terminal, bounds = clusters.means, clusters.shares, clusters.terminal, squares[0]
    _position_squares(clusters.places, shares, y, K, rule, bounds, squares[1])
    best, least, stay = -1, np.inf, np.inf
    if previous >= 0:
        stay = _square(means, shares, previous, y, C, T, radian, rule)
        best, least = previous, stay
    for i in range(K):
        if bounds[i] < least and not terminal[i] and i != previous:
            square = _square(means, shares, i, y, C, T, radian, rule)
            if square < least:
                best, least = i, square
    stay, nearest = np.sqrt(stay), np.sqrt(least)
    if stay <= max_distance and stay - nearest < hysteresis * max_distance:
        return previous
    return best if nearest <= max_distance else -1


@plain_kernel
def _position_squares(places, shares, y, K, rule, total, one):
    """Compute squared distances of positions to all components.

    Inner loops over these, for the vector unit.
    """
    P, D = places.shape[:2]
    for p in range(P):
        square = total if p == 0 else one
        for k in range(D):
            row, x = places[p, k], y[p, k]
            for i in range(K):
                difference = x - row[i]
                square[i] = difference * difference + (square[i] if k > 0 else 0.0)
        if P > 1:
            for i in range(K):
                so_far = np.inf if rule == _NEAREST else 0.0
                if p > 0:
                    so_far = total[i]
                total[i] = _joined(so_far, square[i], shares[i, p], rule)


@plain_kernel
def _joined(so_far, square, share, rule):
    """Return the squared distance including one more frame."""
    return min(so_far, square) if rule == _NEAREST else so_far + share * square


@plain_kernel
def _square(means, shares, i, y, C, T, metres_per_radian, rule):
    """Return the squared distance in point, distance travelled, and direction if both have one."""
    total, first = 0.0 if rule != _NEAREST else np.inf, 2 * C + 1
    for p in range(y.shape[0]):
        square = _point_square(means, i, p, y, C, T, metres_per_radian)
        square += (y[p, first + T] - means[i, p, first + T]) ** 2
        apart = mine = theirs = 0.0
        for k in range(first, first + T):
            apart += (y[p, k] - means[i, p, k]) ** 2
            mine += abs(y[p, k])
            theirs += abs(means[i, p, k])
        if mine > 0.0 and theirs > 0.0:
            square += apart
        total = _joined(total, square, shares[i, p], rule)
    return total


@plain_kernel
def _point_square(means, i, p, y, C, T, metres_per_radian):
    """Return the squared distance of the points x in one frame."""
    square = 0.0
    for k in range(C if C == T else C - 4):
        square += (y[p, k] - means[i, p, k]) ** 2
    if C > T:
        cosine = 0.0
        for k in range(C - 4, C):
            cosine += y[p, k] * means[i, p, k]
        square += (metres_per_radian * 2.0 * np.arccos(min(abs(cosine), 1.0))) ** 2
    return square


@plain_kernel
def _weigh_frames(clusters, q, n_dims, max_distance, rule):
    """Set the frames' shares in the distance to a component, after its update; they sum to one."""
    P, n = clusters.means.shape[1], clusters.counts[q]
    if P == 1 or rule != _RELEVANT:
        clusters.shares[q] = 1.0 / P
        if rule == _GOAL:
            clusters.shares[q] = 0.0
            clusters.shares[q, P - 1] = 1.0
        return
    total = 0.0
    for p in range(P):
        variance = (_LEAST_SPREAD * max_distance) ** 2
        for k in range(n_dims):
            variance += clusters.scatters[q, p, k, k] / n
        clusters.shares[q, p] = 1.0 / variance
        total += 1.0 / variance
    for p in range(P):
        clusters.shares[q, p] /= total


@plain_kernel
def _share_direction(means, q, y, C, T):
    """Give the direction of the one that has it to the one that has none yet."""
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
