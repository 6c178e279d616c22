"""An operator by script: does the whole job through the same intents as a person at the page.

Demonstrates, sends, arms, has the robot get ready, couples and drives a little, clutches, previews, executes, and measures.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from common.control_mode import Action, ControlMode, Phase
from common.messages import ExecutionReport
from common.path_points import duration_s
from common.task import AnyTask, ArmTask, PointTask
from local_site import intents
from local_site.operators_place import CuttableLink, OperatedConsole, OperatorsTime, PlannedOutage, RealTime
from local_site.picture import Picture
from local_site.scripted_actions import ATTEMPTS, PATIENCE_S, JobFailed, ScriptedActions
from local_site.scripted_result import job_result, link_result
from local_site.scripted_skills import skill_for

_DRIVE_S = 1.5
_HAND_PERIOD_S = 1.0 / 30.0
_TRACKING_S = 10.0
_ARRIVAL_S = 180.0
_WORDS_S = 5.0


class ScriptedOperator:
    """Does the job once.

    Args:
        console: The operator's console.
        task: The task.
        control: The link process, to cut the link; None when there is none.
        outage: The cut, or None.
        seed: Of the hand.
        time: The operator's.
    """

    def __init__(
        self,
        console: OperatedConsole,
        task: AnyTask,
        control: CuttableLink | None,
        outage: PlannedOutage | None,
        seed: int,
        time: OperatorsTime | None = None,
    ):
        self._console, self._task, self._control, self._outage = console, task, control, outage
        self._time = time or RealTime()
        self._actions = ScriptedActions(console, self._time)
        self._skill = skill_for(task, self._actions, seed)

    def run(self) -> dict[str, Any]:
        """The whole job.

        Returns:
            What happened, as `farhand demo --json` writes it.

        Raises:
            JobFailed: When a step did not come to its end.
        """
        command = self._actions.command
        self._demonstrate()
        self._send_model()
        self._prepare()
        self._drive()
        command(Action.CLUTCH, ControlMode.HOLD)
        self._execute()
        if self._outage is not None:
            self._cut(self._outage)
        report = self._measure()
        command(Action.CLUTCH, ControlMode.HOLD)
        command(Action.DISARM, ControlMode.DISARMED)
        picture = self._actions.picture
        status = self._control.status() if self._control is not None else {}
        return {
            **job_result(self._task, picture, report),
            "link": link_result(picture, status, self._outage),
            "events": self._actions.events,
        }

    def _demonstrate(self) -> None:
        self._actions.submit(intents.StartAnew())
        n = self._skill.n_demonstrations
        for number in range(1, n + 1):
            self._skill.demonstrate(number)
            learned = self._actions.until(
                f"demonstration {number}", lambda p, k=number: p.n_demonstrations == k and not p.recording
            ).learned
            assert learned is not None
            components = int((~learned.model.terminal).sum())
            self._actions.say(f"demonstration {number} of {n}: {components} components")

    def _send_model(self) -> None:
        learned = self._actions.picture.learned
        if learned is None:
            raise JobFailed("the task has no samples to demonstrate")
        self._actions.submit(intents.SendModel())
        self._actions.until("confirmation of the model", lambda p: p.confirmed_sha256 == learned.sha256)
        self._actions.say(f"model {learned.sha256[:8]}, {len(learned.content)} B, confirmed by the robot")

    def _prepare(self) -> None:
        """Arm the robot where the job begins: whoever was there before may have left it in any mode, anywhere."""
        actions, mode = self._actions, self._actions.picture.mode
        if mode is ControlMode.STOPPED:
            actions.command(Action.RESET, ControlMode.DISARMED)
        elif mode is not ControlMode.DISARMED:
            actions.command(Action.DISARM, ControlMode.DISARMED)
        actions.command(Action.ARM, ControlMode.HOLD)
        if isinstance(self._task, ArmTask) and self._task.skill == "extract":
            return  # it begins in its receptacle
        # A plug in its receptacle comes out first.
        goes = (Action.GO_TO_READY,), (Action.RETRACT, Action.GO_TO_READY)
        if not any(all(actions.manoeuvre(each) for each in ways) for ways in goes):
            raise JobFailed(f"the robot did not get ready: {actions.last_words()}")

    def _drive(self) -> None:
        """Couple and drive; again when the robot has decoupled by itself before it moved."""
        for _ in range(ATTEMPTS):
            self._actions.command(Action.COUPLE, ControlMode.DIRECT)
            if self._followed():
                self._actions.say("drove the robot through the link")
                return
        raise JobFailed(f"the robot did not follow the hand: {self._actions.last_words()}")

    def _followed(self) -> bool:
        """Move the hand a little, one event every 33 ms; whether the robot followed."""
        began_s = self._time.now_s()
        first = self._actions.picture.robot
        assert first is not None
        home = np.array(first.position_m)
        while (t := self._time.now_s() - began_s) < _DRIVE_S:
            self._actions.submit(intents.Hand(self._skill.driving(t), t))
            self._time.pause(_HAND_PERIOD_S)

        def moved(picture: Picture) -> bool:
            return picture.robot is not None and float(np.linalg.norm(picture.robot.position_m - home)) > 0.01

        return moved(self._actions.until("the robot to follow the hand", lambda p: moved(p) or not p.coupled))

    def _execute(self) -> None:
        """Preview and execute; both again when the robot has moved too far in between, or cannot begin from there."""
        for _ in range(ATTEMPTS):
            if not self._actions.preview():
                self._actions.say(f"the preview was refused: {self._actions.last_words()}")
                self._actions.manoeuvre(Action.GO_TO_READY)
                continue
            self._actions.say(f"previewed {self._planned_s():.1f} s of motion")
            if self._actions.attempt(Action.EXECUTE, ControlMode.AUTONOMOUS):
                return
        raise JobFailed(f"the robot did not execute: {self._actions.last_words()}")

    def _planned_s(self) -> float:
        path = self._actions.picture.path
        assert path is not None
        return duration_s(path)

    def _cut(self, outage: PlannedOutage) -> None:
        """Cut the link when so much of the previewed motion is done, and wait until it is back."""
        cut_s = outage.at * self._planned_s()
        if self._control is None:
            raise JobFailed("an outage was asked for, but no link process is configured (link_control)")
        robot = self._actions.until(
            "the moment to cut", lambda p: p.robot is not None and p.robot.elapsed_s >= cut_s
        ).robot
        assert robot is not None
        self._control.outage(outage.kind, outage.duration_s)
        self._actions.say(
            f"cut the link: {outage.kind} for {outage.duration_s:g} s, {robot.elapsed_s:.2f} s into the motion"
        )
        self._time.pause(outage.duration_s)
        self._actions.until("the link to come back", lambda p: p.link.silent_s < 0.5)
        self._actions.say("the link is back")

    def _measure(self) -> ExecutionReport:
        inserts = isinstance(self._task, ArmTask) and self._task.skill == "insert"

        def there(p: Picture) -> bool:
            return p.phase is Phase.SEATED if inserts else p.phase.at_end

        picture = self._actions.until(
            "the arrival", lambda p: there(p) or p.mode is not ControlMode.AUTONOMOUS, _ARRIVAL_S
        )
        if not there(picture):
            # The event that says why may come after the report of the mode.
            self._console.wait_for(lambda p: p.notices[-1:] != picture.notices[-1:], _WORDS_S)
            raise JobFailed(f"the robot ended the execution by itself: {self._actions.last_words()}")
        self._actions.say(f"the robot reports its arrival: {picture.phase}")
        deadline_s, report = self._time.now_s() + PATIENCE_S, None
        while self._time.now_s() < deadline_s:
            report = self._console.ask_report()
            if report is not None and self._settled(report):
                return report
            self._time.pause(0.5)
        if report is None or isinstance(self._task, PointTask):
            raise JobFailed(f"the robot did not report {_TRACKING_S:g} s of tracking")
        return report  # which says by how much it failed

    def _settled(self, report: ExecutionReport) -> bool:
        """Whether a report covers all that the task asks for."""
        if isinstance(self._task, PointTask):
            return report.tracked_s >= _TRACKING_S - 1e-6
        return report.succeeded is True
