"""What surrounds the simulated arm: a receptacle that rests somewhere and can be moved, and what disturbs it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.poses import AT_ORIGIN, moved
from farhand.common.arm.simulation.disturbances import Disturbances, Surroundings
from farhand.common.arm.simulation.placement import Box

Array = NDArray[np.float64]

SLIDE_M_S = 0.03
"""How fast a receptacle goes to its new place: a plug in its bore can follow [m/s]."""


class SimulatedEnvironment:
    """The surroundings at any time.

    Args:
        rest: Where the receptacle rests at first. A pose. Shape (7,).
        disturbances: What moves it, the vehicle and the water.
        box: Where its mouth may rest.
        began_s: How long it has been disturbed already [s].
    """

    def __init__(self, rest: Array, disturbances: Disturbances, box: Box, began_s: float = 0.0):
        self._rest, self._goal_m, self._moved_s = rest, rest[:3], 0.0
        self._disturbances, self._box, self._began_s = disturbances, box, began_s

    def __call__(self, time_s: float) -> Surroundings:
        """Return all that acts on the arm at a time of the simulation [s]."""
        happening, at_s = self._disturbances, self.disturbed_s(time_s)
        return Surroundings(
            moved(self.rest(time_s), happening.receptacle(at_s)),
            moved(AT_ORIGIN, happening.vehicle(at_s)),
            happening.current_m_s(at_s),
            happening.push_n(at_s),
        )

    def disturbed_s(self, time_s: float) -> float:
        """Return for how long there have been disturbances, all boots together [s]."""
        return self._began_s + time_s

    def rest(self, time_s: float) -> Array:
        """Return the pose at which the receptacle rests. Shape (7,)."""
        way = self._goal_m - self._rest[:3]
        length, gone = float(np.linalg.norm(way)), SLIDE_M_S * (time_s - self._moved_s)
        at_m = self._goal_m if gone >= length else self._rest[:3] + way * (gone / length)
        return np.concatenate([at_m, self._rest[3:]])

    def move_to(self, position_m: Array, time_s: float) -> None:
        """Let the receptacle slide to another place in its box from now on. Shape (3,) [m]."""
        self._rest, self._moved_s = self.rest(time_s), time_s
        self._goal_m = np.clip(position_m, self._box.low_m, self._box.high_m)

    def jump(self, time_s: float) -> None:
        """Let the step of the receptacle begin at a time of the simulation [s]."""
        self._disturbances = self._disturbances.stepping_at(self.disturbed_s(time_s))
