"""Datapoints in their order: held back or not, assigned to components, and counted along these."""

from __future__ import annotations

import numpy as np

from farhand.common.model.kernel import kernel
from farhand.local_site.learning.dp_means import assign_points
from farhand.local_site.learning.dwell_statistics import follow
from farhand.local_site.learning.jumps import is_held_back, let_go, stayed_away


@kernel
def learn_points(
    clusters, motion, dwell, segment, points, times, max_distance, weights, hysteresis, rule, labels
):
    """Learn from the datapoints that are no sensor jumps, until the arrays are full. Return how many.

    A datapoint that is held back is labelled with the component before it.
    """
    jumps, radian = motion.jumps, weights[2] * max_distance
    e, first = np.empty(motion.direction.shape[1]), 0
    rest = (max_distance, weights, hysteresis, rule)
    for t in range(times.size):
        if t - first >= clusters.counts.size - clusters.size[0] - jumps.counts[1]:  # it may need a component
            _assign(clusters, motion, dwell, segment, points[first:t], times[first:t], rest, labels[first:t])
            first = t
            if clusters.counts.size - clusters.size[0] <= jumps.counts[1]:
                return t
        if stayed_away(jumps, times[t]):
            _assign(clusters, motion, dwell, segment, points[first:t], times[first:t], rest, labels[first:t])
            first, held = t, jumps.counts[1]
            let_go(jumps, radian, e)
            room = np.empty(held, np.int64)
            _assign(clusters, motion, dwell, segment, jumps.points[:held], jumps.times[:held], rest, room)
        if is_held_back(jumps, points[t], times[t], radian, max_distance, e):
            _assign(clusters, motion, dwell, segment, points[first:t], times[first:t], rest, labels[first:t])
            first, labels[t] = t + 1, motion.component[0]
    _assign(clusters, motion, dwell, segment, points[first:], times[first:], rest, labels[first:])
    return times.size


@kernel
def _assign(clusters, motion, dwell, segment, points, times, rest, labels):
    """Assign consecutive datapoints, for which there is room, and count along their components."""
    if times.size > 0:
        rests = np.empty(times.size, np.bool_)
        assign_points(clusters, motion, points, times, rest[0], rest[1], rest[2], rest[3], labels, rests)
        follow(dwell, segment, labels, times, rests)
