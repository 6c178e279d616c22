"""The plainest competitors: the mean of the demonstrations warped onto start and goal, and a straight line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def mean_warp(motions: Sequence[Array], start: Array, goal: Array) -> Array:
    """The mean motion, moved linearly so that it begins and ends where it should.

    Args:
        motions: Demonstrations at the same phases, in one frame [m]. Shapes (N, D).
        start: Where to begin [m]. Shape (D,).
        goal: Where to end [m]. Shape (D,).
    """
    mean = np.mean(motions, axis=0)
    to_go = np.linspace(1.0, 0.0, len(mean))[:, None]
    return mean + to_go * (start - mean[0]) + (1.0 - to_go) * (goal - mean[-1])


def straight_line(start: Array, goal: Array, n_points: int = 100) -> Array:
    """From start to goal with a hand's timing. Shape (n_points, D) [m]."""
    tau = np.linspace(0.0, 1.0, n_points)[:, None]
    return start + tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2) * (goal - start)
