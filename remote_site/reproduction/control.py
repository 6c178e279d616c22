"""Results of the executor: the control of one tick, and a predicted path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Control:
    """Decision of one tick.

    Args:
        acceleration: Commanded acceleration in the world [m/s^2, rad/s^2]. Shape (T,).
        component: Present component among the learned ones; -1 on a way.
        way: Number of the way that the motion took where it began, -1 for none.
        elapsed_s: Time since the component was entered [s].
        arrived: True once the motion has ended.
        remaining_s: Demonstrated time to the end of the motion [s].
        desired: Desired point in the world, one control period ahead. Shape (C,).
    """

    acceleration: Array
    component: int
    way: int
    elapsed_s: float
    arrived: bool
    remaining_s: float
    desired: Array


@dataclass(frozen=True)
class Path:
    """Predicted motion.

    Args:
        points_local: Points in the last task frame. Shape (N, C).
        points_world: The same points in the world, with the frame as it was at the prediction. Shape (N,
            C).
        step_s: Time between points [s]; the last point may come earlier.
        done: True if the motion ends within the path.
    """

    points_local: Array
    points_world: Array
    step_s: float
    done: bool
