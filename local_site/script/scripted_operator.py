"""Scripted operator: the whole job through the same intents as by a person at the page.

The job: demonstrate each task and send the library; arm, couple and drive a little; then for each task move the
robot to the start, preview, execute, and measure.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from farhand.common.mode_table import Action, ControlMode
from farhand.common.task import AnyTask
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.script.scripted_actions import (
    CuttableLink,
    JobFailed,
    OperatedConsole,
    OperatorsTime,
    PlannedOutage,
    RealTime,
    ScriptedActions,
)
from farhand.local_site.script.scripted_result import link_result, whole_result
from farhand.local_site.script.scripted_task import ScriptedTask

_DRIVE_S, _DRIVE_ATTEMPTS = 1.5, 12
_HAND_PERIOD_S = 1.0 / 30.0


class ScriptedOperator:
    """Operator that runs the job once.

    Args:
        console: The operator's console.
        tasks: Tasks to teach and execute in turn: each starts where the previous one has left the robot.
        control: Control of the simulated link, to cut it; None without one.
        outage: Outage during each execution; None for none.
        seed: Seed of the hand.
        time: Time of the operator.
    """

    def __init__(
        self,
        console: OperatedConsole,
        tasks: Iterable[AnyTask],
        control: CuttableLink | None,
        outage: PlannedOutage | None,
        seed: int,
        time: OperatorsTime | None = None,
    ):
        self._control, self._outage = control, outage
        self._time = time or RealTime()
        self._actions = ScriptedActions(console, self._time)
        self._tasks = [ScriptedTask(task, console, self._actions, seed) for task in tasks]

    def run(self) -> dict[str, Any]:
        """Run the whole job.

        Returns:
            The outcome, as `farhand demo --json` writes it.

        Raises:
            JobFailed: When a step failed.
        """
        if self._actions.picture.mode in (ControlMode.AUTONOMOUS, ControlMode.PAUSED):
            # An earlier operator left an execution unfinished; no other task can be chosen during it.
            self._actions.command(Action.DISARM, ControlMode.DISARMED)
        for task in self._tasks:
            task.teach()
        self._send_library()
        self._arm()
        results = [self._do(task, first=task is self._tasks[0]) for task in self._tasks]
        self._actions.command(Action.DISARM, ControlMode.DISARMED)
        status = self._control.status() if self._control is not None else {}
        return {
            **whole_result(results),
            "link": link_result(self._actions.picture, status, self._outage),
            "events": self._actions.events,
        }

    def _send_library(self) -> None:
        """Send the robot all models that it lacks."""
        self._actions.submit(intents.SendLibrary())
        state = self._actions.until(
            "confirmation of the models",
            lambda p: all(task.confirmed_sha256 == task.learned_sha256 for task in p.tasks),
        )
        for task in state.tasks:
            self._actions.say(
                f"model {task.learned_sha256[:8]}, {task.model_bytes} B, confirmed by the robot"
            )

    def _arm(self) -> None:
        """Bring the robot to HOLD, whatever mode an earlier operator left it in."""
        actions, mode = self._actions, self._actions.picture.mode
        if mode is ControlMode.STOPPED:
            actions.command(Action.RESET, ControlMode.DISARMED)
        elif mode is not ControlMode.DISARMED:
            actions.command(Action.DISARM, ControlMode.DISARMED)
        actions.command(Action.ARM, ControlMode.HOLD)

    def _do(self, task: ScriptedTask, first: bool) -> dict[str, Any]:
        """Run one task; before the first one, drive the robot a little."""
        task.get_ready()
        if first:
            self._drive(task)
            self._actions.command(Action.CLUTCH, ControlMode.HOLD)
        task.execute()
        if self._outage is not None:
            task.cut(self._outage, self._control)
        return task.result()

    def _drive(self, task: ScriptedTask) -> None:
        """Couple and drive; retry when the robot has decoupled on its own before it moved, as on a link that loses much."""
        for _ in range(_DRIVE_ATTEMPTS):
            self._actions.command(Action.COUPLE, ControlMode.DIRECT)
            if self._followed(task):
                self._actions.say("drove the robot through the link")
                return
        raise JobFailed(f"the robot did not follow the hand: {self._actions.last_words()}")

    def _followed(self, task: ScriptedTask) -> bool:
        """Move the hand a little, with an event every 33 ms; return whether the robot followed."""
        began_s = self._time.now_s()
        first = self._actions.picture.robot
        assert first is not None
        home = np.array(first.position_m)
        while (t := self._time.now_s() - began_s) < _DRIVE_S:
            self._actions.submit(intents.Hand(task.driving(t), t))
            self._time.pause(_HAND_PERIOD_S)

        def moved(state: ConsoleState) -> bool:
            return state.robot is not None and float(np.linalg.norm(state.robot.position_m - home)) > 0.01

        return moved(self._actions.until("the robot to follow the hand", lambda p: moved(p) or not p.coupled))
