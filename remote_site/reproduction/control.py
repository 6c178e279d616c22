"""What the executor gives: the control of one tick, and the path that it predicts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Control:
    """What one tick decided.

    Args:
        acceleration: Command in the world [m/s^2, rad/s^2]. Shape (T,).
        component: Present component among those that were learned; -1 on a way.
        way: The way that was chosen where the motion began, -1 for none.
        elapsed_s: Time since it was entered [s].
        arrived: Whether the motion has come to its end.
        remaining_s: Time to its end as it was demonstrated [s].
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
    """A predicted motion.

    Args:
        points_local: Points in the last task frame. Shape (N, C).
        points_world: The same in the world, with the frame as it was at the prediction. Shape (N, C).
        step_s: Time between points [s]; the last one may be earlier.
        done: Whether the motion comes to its end within the path.
    """

    points_local: Array
    points_world: Array
    step_s: float
    done: bool
