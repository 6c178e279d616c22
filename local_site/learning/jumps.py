"""Datapoints of a marker that was lost for a moment: out with one jump, back with another.

A sensor that loses its marker reports it somewhere else for a few samples. Such datapoints are told from a
motion by both of their ends: the step away and the step back are long, and far faster than the hand was
before, and what lies between is over soon. Datapoints after such a step are therefore held back until the
motion is back, and then forgotten; or until it stayed away for too long, and then they count as any other.
A step of the usual speed is no jump, however many datapoints are missing before it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.kernel import kernel, plain_kernel
from farhand.common.model.manifold import Manifold, copy_to, log_at

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# A jump is longer than this fraction of lambda, and so many times faster than the step before it.
_JUMP, _FASTER = 0.5, 5.0
# It is back within this fraction of its length; a marker is lost for this time at most [s].
_BACK, _LOST_S = 0.5, 0.5
MOST_HELD = 256


class Jumps(NamedTuple):
    """Datapoints that are held back, and the last one that was not."""

    counts: Integers  # how many datapoints have counted, up to two, and how many are held back; shape (2,)
    points: Array  # these, shape (MOST_HELD, P, C)
    times: Array  # their times [s], shape (MOST_HELD,)
    last: Array  # the last datapoint that counted in each frame, shape (P, C)
    step: Array  # its speed [m/s], its time [s], and the length of the jump [m]; shape (3,)

    @classmethod
    def begin(cls, n_frames: int, space: Manifold) -> Jumps:
        """Return the state before the first datapoint."""
        shape = (n_frames, space.n_coordinates)
        counts = np.zeros(2, np.int64)
        return cls(counts, np.zeros((MOST_HELD, *shape)), np.zeros(MOST_HELD), np.zeros(shape), np.zeros(3))


@plain_kernel
def stayed_away(jumps, time):
    """Decide whether the datapoints that are held back are a motion after all."""
    held = jumps.counts[1]
    return held > 0 and (time - jumps.times[0] > _LOST_S or held == MOST_HELD)


@kernel
def let_go(jumps, radian, e):
    """Let the datapoints that are held back count; they stay where they are until others are held back."""
    for h in range(jumps.counts[1]):
        _remember(jumps, jumps.points[h], jumps.times[h], _distance(jumps.last, jumps.points[h], radian, e))
    jumps.counts[1] = 0


@plain_kernel
def is_held_back(jumps, point, time, radian, max_distance, e):
    """Decide whether a datapoint is held back; if not, it counts, and those that were are forgotten.

    Args:
        jumps: Changed in place.
        point: In each frame. Shape (P, C).
        time: Later than that of the one before [s].
        radian: What a radian is worth [m].
        max_distance: The lambda [m].
        e: Room for a tangent. Shape (T,).
    """
    away, held = _distance(jumps.last, point, radian, e), jumps.counts[1]
    if held > 0:
        back = away <= min(_BACK * jumps.step[2], jumps.step[2] - _JUMP * max_distance)
    else:
        usual = _FASTER * jumps.step[0] * (time - jumps.step[1])
        back = jumps.counts[0] < 2 or away <= max(_JUMP * max_distance, usual)
    if back:
        jumps.counts[1] = 0
        _remember(jumps, point, time, away)
        return False
    if held == 0:
        jumps.step[2] = away
    for p in range(point.shape[0]):
        copy_to(point[p], jumps.points[held, p])
    jumps.times[held] = time
    jumps.counts[1] = held + 1
    return True


@plain_kernel
def _remember(jumps, point, time, away):
    """Store a datapoint as the last one that counted."""
    if jumps.counts[0] > 0:
        jumps.step[0] = away / (time - jumps.step[1])
    jumps.step[1] = time
    jumps.counts[0] = min(jumps.counts[0] + 1, 2)
    for p in range(point.shape[0]):
        copy_to(point[p], jumps.last[p])


@plain_kernel
def _distance(a, b, radian, e):
    """Return the longest of the distances in the frames [m]. Shapes (P, C), (P, C), (T,)."""
    longest, n = 0.0, e.size if e.size == a.shape[1] else e.size - 3
    for p in range(a.shape[0]):
        log_at(a[p], b[p], e)
        square = 0.0
        for k in range(e.size):
            square += (e[k] if k < n else radian * e[k]) ** 2
        longest = max(longest, square)
    return np.sqrt(longest)
