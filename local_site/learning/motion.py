"""The running demonstration: where it is, where it came from, which way it goes and how far it has come.

Before the hand has travelled a little it has no direction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.kernel import kernel
from farhand.common.model.manifold import Manifold, log_at

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Distance over which the direction of travel is averaged, as a fraction of lambda.
_DIRECTION_LENGTH = 0.1


class Motion(NamedTuple):
    """What is remembered of the running demonstration: a few vectors, never its datapoints."""

    component: Integers  # q_{t-1}, or -1 before the first datapoint; shape (1,)
    clock: Array  # time of the last datapoint, and when its component was entered [s]; shape (2,)
    point: Array  # last datapoint in each frame, shape (P, C)
    direction: Array  # unit steps averaged over a short travelled distance, shape (P, T)
    travelled: Array  # sigma [m], shape (P,)
    start: Array  # s, shape (P, C)

    @classmethod
    def begin(cls, n_frames: int, space: Manifold) -> Motion:
        """Before the first datapoint."""
        point, tangent = (n_frames, space.n_coordinates), (n_frames, space.n_tangent)
        zeros = np.zeros
        return cls(np.array([-1]), zeros(2), zeros(point), zeros(tangent), zeros(n_frames), zeros(point))


@kernel
def travel(motion, point, time, max_distance, w_r, step):
    """Move to the next datapoint: distance and direction depend on the path, not on its timing."""
    if motion.component[0] < 0:
        motion.start[:] = point
        motion.point[:] = point
        motion.clock[:] = time
        return
    n_dims = step.size if step.size == point.shape[1] else step.size - 3
    for p in range(point.shape[0]):
        log_at(motion.point[p], point[p], step)
        step[n_dims:] *= w_r * max_distance
        square = 0.0
        for k in range(step.size):
            square += step[k] ** 2
        if square > 0.0:
            length = np.sqrt(square)
            forget = np.exp(-length / (_DIRECTION_LENGTH * max_distance))
            for k in range(step.size):
                motion.direction[p, k] *= forget
                motion.direction[p, k] += (1.0 - forget) * (step[k] / length)
            motion.travelled[p] += length
    motion.point[:] = point


@kernel
def describe(y, motion, max_distance, weights):
    """The vector y of the present datapoint, but for the elapsed time."""
    C, T = motion.point.shape[1], motion.direction.shape[1]
    for p in range(y.shape[0]):
        square = 0.0
        for k in range(T):
            square += motion.direction[p, k] ** 2
        known = square > 0.0 and motion.travelled[p] >= _DIRECTION_LENGTH * max_distance
        scale = weights[0] * max_distance / np.sqrt(square) if known else 0.0
        for k in range(C):
            y[p, k] = motion.point[p, k]
            y[p, C + k] = motion.start[p, k]
        for k in range(T):
            y[p, 2 * C + 1 + k] = scale * motion.direction[p, k]
        y[p, 2 * C + 1 + T] = weights[1] * motion.travelled[p]
