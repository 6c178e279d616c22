"""The running demonstration: where it is, where it came from, which way it goes and how far it has come.

Distance and direction are those of a point that the hand drags behind it on a slack string, a fifth of
lambda long or longer where the sensor is worse. Noise of the sensor pulls the string taut only now and then and never back, so that it does not
add up to a distance, however many datapoints the sensor gives. Before the hand has travelled a little it
has no direction. A hand that stays where it is for a moment rests.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.kernel import plain_kernel
from farhand.common.model.manifold import Manifold, copy_to, exp_at, log_at
from farhand.local_site.learning.ending import Ending, approach_end
from farhand.local_site.learning.jumps import Jumps
from farhand.local_site.learning.sketch import Sketch

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Length of the string, and distance over which the direction of travel is averaged, as fractions of lambda.
_STRING, _DIRECTION_LENGTH = 0.2, 0.1
# The string is at least so many standard deviations of the sensor long.
_DEVIATIONS = 3.0
# A hand rests while it is within so many lambda, or standard deviations of the sensor, for longer than this [s].
_NEAR, _NEAR_DEVIATIONS, _MOVING_S = 0.02, 6.0, 0.5


class Motion(NamedTuple):
    """State of the running demonstration: a few vectors and a sketch, whatever its length."""

    component: Integers  # q_{t-1}, or -1 before the first datapoint; shape (1,)
    clock: Array  # time of the last datapoint, when its component was entered, when the hand was seen moving last, and
    #   how long it has rested in the component [s]; shape (4,)
    anchor: Array  # where it was then in each frame, shape (P, C)
    point: Array  # last datapoint in each frame, shape (P, C)
    dragged: Array  # the point at the other end of the string in each frame, shape (P, C)
    direction: Array  # unit steps of that point, averaged over a short distance, shape (P, T)
    travelled: Array  # sigma, how far it was dragged [m], shape (P,)
    start: Array  # s, shape (P, C)
    ending: Ending
    jumps: Jumps
    sketch: Sketch

    @classmethod
    def begin(cls, n_frames: int, space: Manifold) -> Motion:
        """Return the state before the first datapoint."""
        point, tangent = (n_frames, space.n_coordinates), (n_frames, space.n_tangent)
        return cls(
            component=np.array([-1]),
            clock=np.zeros(4),
            anchor=np.zeros(point),
            point=np.zeros(point),
            dragged=np.zeros(point),
            direction=np.zeros(tangent),
            travelled=np.zeros(n_frames),
            start=np.zeros(point),
            ending=Ending.begin(n_frames, space),
            jumps=Jumps.begin(n_frames, space),
            sketch=Sketch.begin(n_frames, space),
        )


@plain_kernel
def travel(motion, point, time, max_distance, w_r, step):
    """Move to the next datapoint, and return whether the hand rests since the one before.

    Distance and direction depend on the path, not on its timing.
    """
    if motion.component[0] < 0:
        for p in range(point.shape[0]):
            copy_to(point[p], motion.point[p])
            copy_to(point[p], motion.start[p])
            copy_to(point[p], motion.dragged[p])
            copy_to(point[p], motion.anchor[p])
            copy_to(point[p], motion.ending.point[p])
        motion.clock[0] = motion.clock[1] = motion.clock[2] = time
        return False
    n_dims = step.size if step.size == point.shape[1] else step.size - 3
    radian, rests = w_r * max_distance, motion.clock[0] - motion.clock[2] > _MOVING_S
    for p in range(point.shape[0]):
        approach_end(motion.ending, p, motion.point[p], point[p], time - motion.clock[0], step)
        copy_to(point[p], motion.point[p])
        sensor = np.sqrt(motion.ending.noise[p, 0] + radian * radian * motion.ending.noise[p, 1])
        if _apart(motion.anchor[p], point[p], radian, step) > max(
            _NEAR * max_distance, _NEAR_DEVIATIONS * sensor
        ):
            copy_to(point[p], motion.anchor[p])
            motion.clock[2] = time
            rests = False
        length = _apart(motion.dragged[p], point[p], radian, step)
        dragged = length - max(_STRING * max_distance, _DEVIATIONS * sensor)
        if dragged <= 0.0:
            continue
        forget = np.exp(-dragged / (_DIRECTION_LENGTH * max_distance))
        for k in range(step.size):
            along = step[k] / length
            motion.direction[p, k] *= forget
            motion.direction[p, k] += (1.0 - forget) * (along if k < n_dims else radian * along)
            step[k] = dragged * along
        exp_at(motion.dragged[p], step, motion.dragged[p])
        motion.travelled[p] += dragged
    return rests


@plain_kernel
def _apart(a, b, radian, step):
    """Write the tangent from one point to another, and return its length [m]. Shapes (C,), (C,), (T,)."""
    log_at(a, b, step)
    n_dims, square = step.size if step.size == a.size else step.size - 3, 0.0
    for k in range(step.size):
        square += (step[k] if k < n_dims else radian * step[k]) ** 2
    return np.sqrt(square)


@plain_kernel
def describe(y, motion, max_distance, weights):
    """Fill the vector y of the present datapoint, except the elapsed time."""
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
