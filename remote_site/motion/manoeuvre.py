"""A short straight motion that needs neither a model nor sensing: back off, retract, go to ready."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.control_mode import Phase
from farhand.common.wire.messages import Command
from farhand.remote_site.interface.embodiment import Embodiment, Way
from farhand.remote_site.interface.plant import EffectorState, Plant
from farhand.remote_site.perception.sensing import Sensing

Array = NDArray[np.float64]

SPEED = 0.5
"""Of the task's limit."""
BACK_OFF_M, BACK_OFF_S = 0.020, 2.0
_REACHED_M = 2e-3
_STANDING_M_S = 5e-3
_PATIENCE_S = 5.0


@dataclass(frozen=True, eq=False)
class Straight:
    """The way to a place that stays where it is.

    Args:
        place: Shape (C,).
        speed: At the full pace [m/s].
        time_limit_s: See `Way`.
    """

    place: Array
    speed: float
    time_limit_s: float

    @classmethod
    def to(cls, place: Array, start: Array, speed: float) -> Straight:
        """With time enough to get there from a start. Shapes (C,) and (C,)."""
        return cls(place, speed, patience_s(float(np.linalg.norm(place - start)), speed))

    def goal(self) -> Array:
        """See `Way`."""
        return self.place

    def speed_m_s(self) -> float:
        """See `Way`."""
        return self.speed


def giving_way(effector: EffectorState, speed_m_s: float) -> Straight | None:
    """The way where the force on the tool pushes it; None where no force is measured."""
    if effector.force_n is None:
        return None
    place, away = effector.point.copy(), effector.force_n / max(float(np.linalg.norm(effector.force_n)), 1e-9)
    place[: effector.n_dims] += BACK_OFF_M * away
    return Straight(place, speed_m_s, BACK_OFF_S)


def patience_s(distance_m: float, speed_m_s: float) -> float:
    """How long a way may take at most [s]."""
    return _PATIENCE_S + 2.0 * distance_m / speed_m_s


class Manoeuvre:
    """Goes straight to a place, and gives up when it takes too long.

    Args:
        phase: What the robot is said to be doing.
        way: Where it leads.
        command: Whose second answer its end is; None when the robot began it itself.
        why: What made the robot begin it itself.
        pace: Share of its speed; changeable on the way.
    """

    def __init__(
        self, phase: Phase, way: Way, command: Command | None = None, why: str = "", pace: float = 1.0
    ):
        self.phase, self.command, self.why, self.pace = phase, command, why, pace
        self._way, self._left_s = way, way.time_limit_s
        self.reached = False

    def step(self, plant: Plant, effector: EffectorState, dt_s: float) -> bool:
        """Move for one control period [s]. True when the manoeuvre has ended, at its goal or in time."""
        goal = self._way.goal()
        plant.follow(goal, self.pace * self._way.speed_m_s(), dt_s)
        self._left_s -= self.pace * dt_s
        near = float(np.linalg.norm(effector.position_m - goal[: effector.n_dims])) <= _REACHED_M
        self.reached = near and effector.own_speed_m_s <= _STANDING_M_S
        return self.reached or self._left_s <= 0.0


class Manoeuvres:
    """Makes the manoeuvres of one robot.

    Args:
        embodiment: Knows their ways.
        sensing: Where the robot is now.
    """

    def __init__(self, embodiment: Embodiment, sensing: Sensing):
        self._embodiment, self._sensing = embodiment, sensing

    def make(
        self, phase: Phase, command: Command | None = None, why: str = "", pace: float = 1.0
    ) -> Manoeuvre:
        """The manoeuvre of a phase from here; see `Manoeuvre` for the arguments.

        Raises:
            ValueError: When the phase is none of a manoeuvre, or it is not known where that leads.
        """
        way = self._embodiment.way(phase, self._sensing)
        if way is None:
            raise ValueError(f"no manoeuvre for {phase!r}")
        return Manoeuvre(phase, way, command, why, pace)
