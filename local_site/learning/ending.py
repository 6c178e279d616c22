"""End of a demonstration, estimated through the noise of its sensor.

The last datapoint alone is as wrong as the sensor. Therefore a line through the last tenth of a second is
kept up to date (Holt's double exponential smoothing), and the sensor's noise is estimated from the second
differences, in which a hand's motion hardly shows. If the line misses the last datapoint by no more than the
noise explains, the line counts; if by more, the motion bends, and the datapoint counts. A sensor without
noise gives the last datapoint.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.kernel import kernel, plain_kernel
from farhand.common.model.manifold import Manifold, exp_at, log_at

Array = NDArray[np.float64]

# Over which time the line is fitted [s], and how many deviations of the sensor it may miss a datapoint by.
_FITTED_S, _MISSED = 0.1, 3.0


class Ending(NamedTuple):
    """Line through the last datapoints, and the sensor's noise, in each frame."""

    point: Array  # where the line is now, shape (P, C)
    velocity: Array  # its slope [m/s, rad/s], shape (P, T)
    step: Array  # the last difference of two datapoints, shape (P, T)
    noise: Array  # variance of the sensor, of position and of rotation, over their axes; shape (P, 2)

    @classmethod
    def begin(cls, n_frames: int, space: Manifold) -> Ending:
        """Return the state before the first datapoint."""
        P, C, T = n_frames, space.n_coordinates, space.n_tangent
        return cls(np.zeros((P, C)), np.zeros((P, T)), np.zeros((P, T)), np.zeros((P, 2)))


@plain_kernel
def approach_end(ending, p, before, point, dt, e):
    """Take in the next datapoint of a frame. Shapes (C,), (C,); e is room for a tangent, shape (T,)."""
    T = e.size
    keep = np.exp(-dt / _FITTED_S)
    log_at(before, point, e)
    n = T if point.size == T else T - 3
    for part, (first, last) in enumerate(((0, n), (n, T))):
        square = 0.0
        for k in range(first, last):
            square += (e[k] - ending.step[p, k]) ** 2
            ending.step[p, k] = e[k]
        if last > first:  # a second difference has six times the variance
            ending.noise[p, part] += (1.0 - keep) * (square / 6.0 - ending.noise[p, part])
    for k in range(T):
        e[k] = dt * ending.velocity[p, k]
    exp_at(ending.point[p], e, ending.point[p])
    log_at(ending.point[p], point, e)
    for k in range(T):
        ending.velocity[p, k] += (1.0 - keep) ** 2 / dt * e[k]
        e[k] *= 1.0 - keep * keep
    exp_at(ending.point[p], e, ending.point[p])


@kernel
def ended_at(ending, p, point, e, out):
    """Write where the motion ended in a frame; between the last datapoint and the line. Shapes (C,), (T,), (C,)."""
    T = e.size
    log_at(point, ending.point[p], e)
    n = T if point.size == T else T - 3
    for part, (first, last) in enumerate(((0, n), (n, T))):
        square = 0.0
        for k in range(first, last):
            square += e[k] ** 2
        if square > 0.0:
            share = min(1.0, _MISSED**2 * ending.noise[p, part] / square)
            for k in range(first, last):
                e[k] *= share
    exp_at(point, e, out)
