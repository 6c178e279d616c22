"""A short straight motion that needs neither a model nor sensing: back off, retract, go to ready."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from common.control_mode import Phase
from common.messages import Command
from common.task import PointTask
from remote_site.plant import EffectorState, Plant
from remote_site.sensing import Sensing

_REACHED_M = 2e-3
_STANDING_M_S = 5e-3
_SPEED = 0.5
"""Of the task's limit."""
_BACK_OFF_M, _BACK_OFF_S = 0.020, 2.0
_PATIENCE_S = 5.0


class Manoeuvre:
    """Goes straight to a place, and gives up when it takes too long.

    Args:
        phase: What the robot is said to be doing.
        goal_m: Where it ends. Shape (D,) [m].
        speed_m_s: Its speed at the full pace [m/s].
        time_limit_s: After which it ends where it is, at the full pace [s].
        command: Whose second answer its end is; None when the robot began it itself.
        why: What made the robot begin it itself.
        pace: Share of its speed; changeable on the way.
    """

    def __init__(
        self,
        phase: Phase,
        goal_m: NDArray[np.float64],
        speed_m_s: float,
        time_limit_s: float,
        command: Command | None = None,
        why: str = "",
        pace: float = 1.0,
    ):
        self.phase, self.command, self.why, self.pace = phase, command, why, pace
        self._goal, self._speed, self._left_s = goal_m, speed_m_s, time_limit_s
        self.reached = False

    def step(self, plant: Plant, effector: EffectorState, dt_s: float) -> bool:
        """Move for one control period [s]. True when the manoeuvre has ended, at its goal or in time."""
        plant.follow(effector.shifted_to(self._goal), self.pace * self._speed, dt_s)
        self._left_s -= self.pace * dt_s
        near = float(np.linalg.norm(effector.position_m - self._goal)) <= _REACHED_M
        self.reached = near and float(np.linalg.norm(effector.velocity_m_s)) <= _STANDING_M_S
        return self.reached or self._left_s <= 0.0


class Manoeuvres:
    """Makes the manoeuvres of one task.

    Args:
        task: Where it retracts and gets ready to.
        sensing: Where the robot is now.
    """

    def __init__(self, task: PointTask, sensing: Sensing):
        self._task, self._sensing = task, sensing

    def make(
        self, phase: Phase, command: Command | None = None, why: str = "", pace: float = 1.0
    ) -> Manoeuvre:
        """The manoeuvre of a phase from here; see `Manoeuvre` for the arguments.

        Raises:
            ValueError: When the phase is none of a manoeuvre, or the task does not say where to retract to.
        """
        effector, task = self._sensing.effector, self._task
        speed_m_s = _SPEED * task.limits.speed_m_s
        if phase is Phase.BACKING_OFF and effector.force_n is not None:
            # The way back is where the force on the tool pushes it.
            away = effector.force_n / max(float(np.linalg.norm(effector.force_n)), 1e-9)
            goal = effector.position_m + _BACK_OFF_M * away
            return Manoeuvre(phase, goal, speed_m_s, _BACK_OFF_S, command, why, pace)
        if phase is Phase.RETRACTING and task.retract_m is not None:
            goal = effector.position_m + self._sensing.frames[0].A @ np.array(task.retract_m)
        elif phase is Phase.GOING_TO_READY:
            goal = np.array(task.start_m if task.ready_m is None else task.ready_m)
        else:
            raise ValueError(f"no manoeuvre for {phase!r}")
        goal = np.clip(goal, 0.0, task.workspace_m)
        distance_m = float(np.linalg.norm(goal - effector.position_m))
        time_limit_s = _PATIENCE_S + 2.0 * distance_m / speed_m_s
        return Manoeuvre(phase, goal, speed_m_s, time_limit_s, command, why, pace)
