"""Simulated surroundings of the arm: a receptacle that can be moved, and disturbances.

Record of a task with the plug, from the simulation's truth: where the plug is, and the forces on it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.kinematics import AT_ORIGIN, compose, inverse, moved
from farhand.common.arm.simulation.disturbances import Disturbances, Surroundings
from farhand.common.arm.simulation.simulation import Simulation
from farhand.common.arm.simulation.starts_and_goals import Box, Goal
from farhand.remote_site.interface.plant import EffectorState

Array = NDArray[np.float64]

SLIDE_M_S = 0.03
"""Speed of a receptacle that is moved to a new place, slow enough for a plug in its bore to follow [m/s]."""


class SimulatedEnvironment:
    """Surroundings as a function of time.

    Args:
        rest: First resting pose of the receptacle. Shape (7,).
        disturbances: Motions of the receptacle, the vehicle and the water.
        box: Region in which its mouth may rest.
        began_s: Time for which the disturbances have been going on already [s].
    """

    def __init__(self, rest: Array, disturbances: Disturbances, box: Box, began_s: float = 0.0):
        self._rest, self._goal_m, self._moved_s = rest, rest[:3], 0.0
        self._disturbances, self._box, self._began_s = disturbances, box, began_s

    def __call__(self, time_s: float) -> Surroundings:
        """Return all disturbances of the arm at a time of the simulation [s]."""
        happening, at_s = self._disturbances, self.disturbed_s(time_s)
        return Surroundings(
            moved(self.rest(time_s), happening.receptacle(at_s)),
            moved(AT_ORIGIN, happening.vehicle(at_s)),
            happening.current_m_s(at_s),
            happening.push_n(at_s),
        )

    def disturbed_s(self, time_s: float) -> float:
        """Return the time of the disturbances, over all boots [s]."""
        return self._began_s + time_s

    def rest(self, time_s: float) -> Array:
        """Return the receptacle's resting pose. Shape (7,)."""
        way = self._goal_m - self._rest[:3]
        length, gone = float(np.linalg.norm(way)), SLIDE_M_S * (time_s - self._moved_s)
        at_m = self._goal_m if gone >= length else self._rest[:3] + way * (gone / length)
        return np.concatenate([at_m, self._rest[3:]])

    def move_to(self, position_m: Array, time_s: float) -> None:
        """Slide the receptacle to another place in its box, beginning at a time. Shape (3,) [m]."""
        self._rest, self._moved_s = self.rest(time_s), time_s
        self._goal_m = np.clip(position_m, self._box.low_m, self._box.high_m)

    def jump(self, time_s: float) -> None:
        """Begin the receptacle's step at a time of the simulation [s]."""
        self._disturbances = self._disturbances.stepping_at(self.disturbed_s(time_s))


_HELD_S = 1.0
"""Time for which the goal must be held to count as reached [s]."""


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
