"""Short straight motion that needs neither a model nor sensing: back off, retract, go to ready."""

from __future__ import annotations

import numpy as np

from farhand.common.mode_table import Phase
from farhand.common.wire.messages import Command
from farhand.common.wire.reasons import Reason
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.interface.goals import ManoeuvreGoal
from farhand.remote_site.interface.plant import EffectorState, Plant
from farhand.remote_site.interface.sensing import Sensing

_REACHED_M = 2e-3
_STANDING_M_S = 5e-3


class Manoeuvre:
    """Straight motion to a goal, with a time limit.

    Args:
        phase: Phase that the robot reports meanwhile.
        goal: Goal of the motion.
        command: Command that its end completes; None if the robot began it on its own.
        why: Reason why the robot began it on its own.
        pace: Share of its speed; changeable during the motion.
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
        """Move for one control period [s].

        Return True when it has ended, at its goal or by its time limit.
        """
        goal = self._goal.goal()
        plant.follow(goal, self.pace * self._goal.speed_m_s(), dt_s)
        self._left_s -= self.pace * dt_s
        near = float(np.linalg.norm(effector.position_m - goal[: effector.n_dims])) <= _REACHED_M
        self.reached = near and effector.own_speed_m_s <= _STANDING_M_S
        return self.reached or self._left_s <= 0.0


class Manoeuvres:
    """Factory of one robot's manoeuvres.

    Args:
        embodiment: The robot; its skill has the goals.
        sensing: Newest measurements.
    """

    def __init__(self, embodiment: Embodiment, sensing: Sensing):
        self._embodiment, self._sensing = embodiment, sensing

    def make(
        self, phase: Phase, command: Command | None = None, why: Reason | None = None, pace: float = 1.0
    ) -> Manoeuvre:
        """Make the manoeuvre of a phase from here; see `Manoeuvre` for the arguments.

        Raises:
            ValueError: When the phase has no manoeuvre, or its goal is unknown.
        """
        goal = self._embodiment.skill.goal(phase, self._sensing)
        if goal is None:
            raise ValueError(f"no manoeuvre for {phase!r}")
        return Manoeuvre(phase, goal, command, why, pace)
