"""Record of a task with the plug, from the simulation's truth: where the plug is, and the forces on it."""

from __future__ import annotations

import math
from typing import Any

from farhand.common.arm.poses import compose, inverse
from farhand.common.arm.simulation.goals import Goal
from farhand.common.arm.simulation.simulation import Simulation
from farhand.remote_site.interface.plant import EffectorState

_HELD_S = 1.0
"""Time for which the goal must have been held to be reached [s]."""


class PlugRecord:
    """Record of the plug during an execution.

    Args:
        simulation: Source of the true poses and forces.
        goal: Goal of the task.
    """

    def __init__(self, simulation: Simulation, goal: Goal):
        self._simulation, self._goal = simulation, goal
        self._peak_n = self._sum_n = self._held_s = 0.0
        self._n = 0
        self._depth_m = self._lateral_m = math.nan

    def measure(self, effector: EffectorState, arrived: bool, now_s: float, dt_s: float) -> None:
        """See `Record.measure`."""
        force_n = effector.contact_n or 0.0
        local = compose(inverse(self._simulation.mouth), self._simulation.tip)
        self._depth_m, self._lateral_m = float(local[2]), math.hypot(local[0], local[1])
        self._peak_n = max(self._peak_n, force_n)
        if arrived:
            self._sum_n += force_n
            self._n += 1
        reached = self._goal.reached(local, force_n, self._simulation)
        self._held_s = self._held_s + dt_s if reached else 0.0

    def fields(self) -> dict[str, Any]:
        """See `Record.fields`."""
        if math.isnan(self._depth_m):
            return {}
        return {
            "depth_m": self._depth_m,
            "lateral_m": self._lateral_m,
            "peak_force_n": self._peak_n,
            "holding_force_n": self._sum_n / self._n if self._n else None,
            "succeeded": self._held_s >= _HELD_S - 1e-9,
        }
