"""One task by script: taught through the same intents as by a person at the page, executed, measured."""

from __future__ import annotations

from typing import Any

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.task import AnyTask, ArmTask, PointTask
from farhand.common.wire.messages import ExecutionReport
from farhand.common.wire.motion_encoding import duration_s
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.console.intent_permission import refusal_of
from farhand.local_site.script.scripted_actions import (
    ATTEMPTS,
    PATIENCE_S,
    CuttableLink,
    JobFailed,
    OperatedConsole,
    PlannedOutage,
    ScriptedActions,
)
from farhand.local_site.script.scripted_result import job_result
from farhand.local_site.script.scripted_skills import skill_for

_TRACKING_S = 10.0
_ARRIVAL_S = 180.0
_WORDS_S = 5.0


class ScriptedTask:
    """Scripted teaching and execution of one task.

    Args:
        task: The task.
        console: The operator's console.
        actions: Actions at that console.
        seed: Seed of the hand.
    """

    def __init__(self, task: AnyTask, console: OperatedConsole, actions: ScriptedActions, seed: int):
        self._task, self._console, self._actions = task, console, actions
        self._skill = skill_for(task, actions, seed)

    def choose(self) -> None:
        """Choose this task, unless it is chosen already."""
        name = self._task.name
        if self._actions.picture.task.name != name:
            self._actions.submit(intents.Choose(name))
            self._actions.until(f"the choice of {name}", lambda p: p.task.name == name)
            self._actions.say(f"task {name}")

    def teach(self) -> None:
        """Demonstrate the task, starting without demonstrations.

        Raises:
            JobFailed: When a demonstration failed, or the task has none.
        """
        n = self._skill.n_demonstrations
        if not n:
            raise JobFailed("the task has no samples to demonstrate")
        self.choose()
        if refusal_of(intents.StartAnew(), self._actions.picture) is None:
            self._actions.submit(intents.StartAnew())
        for number in range(1, n + 1):
            self._skill.demonstrate(number)
            learned = self._actions.until(
                f"demonstration {number}", lambda p, k=number: p.n_demonstrations == k and not p.recording
            ).learned
            assert learned is not None
            components = int((~learned.model.terminal).sum())
            self._actions.say(f"demonstration {number} of {n}: {components} components")

    def get_ready(self) -> None:
        """Move the robot to the start of this task.

        Raises:
            JobFailed: When the robot did not reach it.
        """
        self.choose()
        if isinstance(self._task, ArmTask) and self._task.skill == "extract":
            return  # it begins in the receptacle
        # A plug in its receptacle is extracted first.
        goes = (Action.GO_TO_READY,), (Action.RETRACT, Action.GO_TO_READY)
        for _ in range(ATTEMPTS):  # a link that loses much may end a manoeuvre before its goal
            if any(all(self._actions.manoeuvre(each) for each in ways) for ways in goes):
                return
        raise JobFailed(f"the robot did not reach its ready pose: {self._actions.last_words()}")

    def driving(self, time_s: float) -> tuple[float, ...]:
        """Return the hand's pose while it drives the robot. Length C."""
        return self._skill.driving(time_s)

    def execute(self) -> None:
        """Preview and execute; retry if the robot moved too far in between, or cannot start from its pose.

        Raises:
            JobFailed: When the execution did not begin.
        """
        for _ in range(ATTEMPTS):
            if not self._actions.preview():
                self._actions.say(f"the preview was refused: {self._actions.last_words()}")
                self._actions.manoeuvre(Action.GO_TO_READY)
                continue
            self._actions.say(f"previewed {self._planned_s():.1f} s of motion")
            if self._actions.attempt(Action.EXECUTE, ControlMode.AUTONOMOUS):
                return
        raise JobFailed(f"the robot did not execute: {self._actions.last_words()}")

    def cut(self, outage: PlannedOutage, control: CuttableLink | None) -> None:
        """Cut the link after the planned share of the previewed motion, and wait until it is back.

        Args:
            outage: The planned cut.
            control: Control of the simulated link; None without one.

        Raises:
            JobFailed: When there is no link process, or the link did not come back.
        """
        cut_s = outage.at * self._planned_s()
        if control is None:
            raise JobFailed("an outage was asked for, but no link process is configured (link_control)")
        robot = self._actions.until(
            "the moment to cut", lambda p: p.robot is not None and p.robot.elapsed_s >= cut_s
        ).robot
        assert robot is not None
        control.outage(outage.kind, outage.duration_s)
        self._actions.say(
            f"cut the link: {outage.kind} for {outage.duration_s:g} s, {robot.elapsed_s:.2f} s into the motion"
        )
        self._actions.time.pause(outage.duration_s)
        self._actions.until("the link to come back", lambda p: p.link.silent_s < 0.5)
        self._actions.say("the link is back")

    def result(self) -> dict[str, Any]:
        """Wait for the end of the execution, and clutch; return what was taught and what the robot did.

        Raises:
            JobFailed: When the robot did not arrive, or did not report.
        """
        report = self._measure()
        self._actions.command(Action.CLUTCH, ControlMode.HOLD)
        return job_result(self._task, self._actions.picture, report)

    def _measure(self) -> ExecutionReport:
        inserts = isinstance(self._task, ArmTask) and self._task.skill == "insert"

        def there(p: ConsoleState) -> bool:
            return p.phase is Phase.SEATED if inserts else p.phase.at_end

        state = self._actions.until(
            "the arrival", lambda p: there(p) or p.mode is not ControlMode.AUTONOMOUS, _ARRIVAL_S
        )
        if not there(state):
            # The event with the reason may come after the report of the mode.
            self._console.wait_for(lambda p: p.notices[-1:] != state.notices[-1:], _WORDS_S)
            raise JobFailed(f"the robot ended the execution on its own: {self._actions.last_words()}")
        self._actions.say(f"the robot reports its arrival: {state.phase}")
        deadline_s, report = self._actions.time.now_s() + PATIENCE_S, None
        while self._actions.time.now_s() < deadline_s:
            report = self._console.ask_report()
            if report is not None and self._settled(report):
                return report
            self._actions.time.pause(0.5)
        if report is None or isinstance(self._task, PointTask):
            raise JobFailed(f"the robot did not report {_TRACKING_S:g} s of tracking")
        return report  # the report has the error of a failed task

    def _settled(self, report: ExecutionReport) -> bool:
        """Decide whether a report belongs to this task and is complete."""
        if report.task != self._task.name:
            return False
        if isinstance(self._task, PointTask):
            return report.tracked_s >= _TRACKING_S - 1e-6
        unjudged = report.succeeded is None and report.tracked_s >= _TRACKING_S - 1e-6
        return report.succeeded is True or unjudged

    def _planned_s(self) -> float:
        path = self._actions.picture.path
        assert path is not None
        return duration_s(path)
