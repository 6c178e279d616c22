"""The record of an insertion, by the simulation's truth: how deep the plug is, and what force it took."""

from __future__ import annotations

from typing import Any

from common.robot.simulation import Simulation
from remote_site.guards import force_of
from remote_site.plant import EffectorState

DEPTH_M, LATERAL_M, HELD_S = (0.075, 0.095), 0.004, 1.0
"""A plug is in when it is so deep, but not through, and so near the axis, for so long."""


class PlugRecord:
    """What happened to the plug.

    Args:
        simulation: The truth.
    """

    def __init__(self, simulation: Simulation):
        self._simulation = simulation
        self._peak_n = self._sum_n = self._held_s = 0.0
        self._n = 0

    def measure(self, effector: EffectorState, arrived: bool, now_s: float, dt_s: float) -> None:
        """See `embodiment.Record.measure`."""
        force_n, inside = force_of(effector) or 0.0, self._simulation.insertion
        self._peak_n = max(self._peak_n, force_n)
        if arrived:
            self._sum_n += force_n
            self._n += 1
        good = DEPTH_M[0] <= inside.depth_m <= DEPTH_M[1] and inside.lateral_m < LATERAL_M
        self._held_s = self._held_s + dt_s if good else 0.0

    def fields(self) -> dict[str, Any]:
        """See `embodiment.Record.fields`."""
        inside = self._simulation.insertion
        return {
            "depth_m": inside.depth_m,
            "lateral_m": inside.lateral_m,
            "peak_force_n": self._peak_n,
            "holding_force_n": self._sum_n / self._n if self._n else None,
            "succeeded": self._held_s >= HELD_S - 1e-9,
        }
