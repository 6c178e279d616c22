"""Goals of the arm's tasks, judged by the simulation's truth."""

from __future__ import annotations

import math
from collections import deque
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.simulation.simulation import TICK_S, Simulation

Array = NDArray[np.float64]

DEPTH_M, LATERAL_M = (0.075, 0.095), 0.004

MAX_DRAGGED_M = 0.005
"""Largest distance that a receptacle may have been dragged from its rest [m]."""
STANDOFF_M, AWAY_M = 0.12, 0.015
"""A plug that is out is so far before the mouth on the axis, and at most so far from there [m]."""
AT_REST_M_S, REST_S, TOUCHED_N = 0.015, 0.5, 5.0
"""Slower than this [m/s], in the mean over so long [s], it is at rest: the noise of the tracker moves it about with
10 mm/s. With less force on it than this it touches nothing [N]."""


class Goal(Protocol):
    """Goal of a trial, checked in each control period."""

    enters: bool
    """True for a plug that enters the bore, False for one that is extracted."""

    def reached(self, local: Array, force_n: float, simulation: Simulation) -> bool:
        """Decide whether the goal is reached in this control period.

        Args:
            local: Pose of the tip in the true frame of the receptacle. Shape (7,).
            force_n: Force on the tool, tared [N].
            simulation: Source of the true poses.
        """
        ...


class Seated:
    """Goal of an insertion: deep enough, not through the bottom, and on the axis."""

    enters = True

    def reached(self, local: Array, force_n: float, simulation: Simulation) -> bool:
        """Decide whether the goal is reached in this control period."""
        deep = DEPTH_M[0] <= float(local[2]) <= DEPTH_M[1]
        return deep and math.hypot(local[0], local[1]) < LATERAL_M


class Withdrawn:
    """Goal of an extraction: at rest at the stand-off, without contact, the receptacle never dragged along.

    Args:
        away_m: Largest distance from the stand-off [m].
        at_rest_m_s: Largest speed relative to the receptacle [m/s].
    """

    enters = False

    def __init__(self, away_m: float = AWAY_M, at_rest_m_s: float = AT_REST_M_S):
        self._away_m, self._at_rest_m_s = away_m, at_rest_m_s
        self.dragged_m = 0.0
        """Largest distance that the receptacle was dragged from its rest [m]."""
        self.out_s = math.nan
        """Time when the tip left the mouth [s]."""
        self._way = deque[Array](maxlen=round(REST_S / TICK_S) + 1)

    def reached(self, local: Array, force_n: float, simulation: Simulation) -> bool:
        """Decide whether the goal is reached in this control period."""
        self.dragged_m = max(self.dragged_m, simulation.deflection_m)
        self._way.append(local[:3])
        if math.isnan(self.out_s) and local[2] < 0.0:
            self.out_s = simulation.time_s
        speed_m_s = float(np.linalg.norm(local[:3] - self._way[0])) / REST_S
        away_m = math.hypot(local[0], local[1], local[2] + STANDOFF_M)
        near, at_rest = away_m <= self._away_m, speed_m_s <= self._at_rest_m_s
        return near and at_rest and force_n <= TOUCHED_N and self.dragged_m <= MAX_DRAGGED_M
