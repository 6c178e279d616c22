"""A short straight motion that needs neither a model nor sensing: back off, retract, go to ready."""

from __future__ import annotations

import numpy as np

from farhand.common.control_mode import Phase
from farhand.common.wire.messages import Command
from farhand.common.wire.reasons import Reason
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.interface.goals import ManoeuvreGoal
from farhand.remote_site.interface.plant import EffectorState, Plant
from farhand.remote_site.interface.sensing import Sensing

_REACHED_M = 2e-3
_STANDING_M_S = 5e-3


class Manoeuvre:
    """Goes straight to a place, and gives up when it takes too long.

    Args:
        phase: What the robot is said to be doing.
        goal: Where it leads.
        command: Whose second answer its end is; None when the robot began it itself.
        why: What made the robot begin it itself; None for a command.
        pace: Share of its speed; changeable on the way.
    """

    def __init__(
        self,
        phase: Phase,
        goal: ManoeuvreGoal,
        command: Command | None = None,
        why: Reason | None = None,
        pace: float = 1.0,
    ):
        self.phase, self.command, self.why, self.pace = phase, command, why, pace
        self._goal, self._left_s = goal, goal.time_limit_s
        self.reached = False

    def step(self, plant: Plant, effector: EffectorState, dt_s: float) -> bool:
        """Move for one control period [s]. True when the manoeuvre has ended, at its goal or in time."""
        goal = self._goal.goal()
        plant.follow(goal, self.pace * self._goal.speed_m_s(), dt_s)
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
        self, phase: Phase, command: Command | None = None, why: Reason | None = None, pace: float = 1.0
    ) -> Manoeuvre:
        """The manoeuvre of a phase from here; see `Manoeuvre` for the arguments.

        Raises:
            ValueError: When the phase is none of a manoeuvre, or it is not known where that leads.
        """
        goal = self._embodiment.skill.goal(phase, self._sensing)
        if goal is None:
            raise ValueError(f"no manoeuvre for {phase!r}")
        return Manoeuvre(phase, goal, command, why, pace)
