"""Where the scripted job cannot go on it says at which step and why. The whole job: `tests/integration`."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from msgspec import structs

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire.messages import Command
from farhand.common.wire.reasons import in_words
from farhand.local_site.script.scripted_actions import JobFailed, RealTime, ScriptedActions
from farhand.local_site.script.scripted_operator import ScriptedOperator
from farhand.local_site.script.scripted_task import ScriptedTask
from tests.local_site.robot_end import TASK, desk


def test_a_task_without_samples_cannot_be_demonstrated(tmp_path: Path):
    empty = structs.replace(TASK, samples=())
    with desk(tmp_path, empty) as it, pytest.raises(JobFailed, match="no samples"):
        ScriptedOperator(it.console, [empty], None, None, 0).run()


def test_a_command_is_tried_three_times_and_then_fails_in_the_robots_words(tmp_path: Path):
    with desk(tmp_path) as it:
        it.connected(ControlMode.DISARMED)

        def refuse(command: Command) -> None:
            it.robot.refusal = in_words("the arm is being serviced")

        it.robot.on_command = refuse
        operator = ScriptedOperator(it.console, [TASK], None, None, 0)
        with pytest.raises(JobFailed, match=r"arm: .*HOLD: .*being serviced"):
            operator.run()
        assert [command.action for command in it.robot.heard(Command)] == [Action.ARM] * 3


def test_the_ready_pose_is_tried_three_times_each_with_a_plug_taken_out_first_and_then_fails_in_the_robots_words(
    tmp_path: Path,
):
    with desk(tmp_path) as it:
        it.connected(ControlMode.DISARMED)

        def refuse(command: Command) -> None:
            it.robot.refusal = in_words(f"{command.action} is not allowed now")
            it.robot.report(ControlMode.HOLD)

        it.robot.on_command = refuse
        with pytest.raises(JobFailed, match=r"did not reach its ready pose: .*not allowed"):
            ScriptedOperator(it.console, [TASK], None, None, 0).run()
        asked = [command.action for command in it.robot.heard(Command)]
        assert asked == [Action.ARM, *[Action.GO_TO_READY, Action.RETRACT] * 3]


@pytest.mark.parametrize(
    ("left", "first"), [(ControlMode.STOPPED, Action.RESET), (ControlMode.PAUSED, Action.DISARM)]
)
def test_whatever_another_job_has_left_the_robot_is_disarmed_first(
    tmp_path: Path, left: ControlMode, first: Action
):
    with desk(tmp_path) as it:
        it.connected(left)

        def stop_here(command: Command) -> None:
            if command.action is Action.ARM:
                it.robot.refusal = in_words("the test ends here")
            it.robot.report(ControlMode.DISARMED)

        it.robot.on_command = stop_here
        with pytest.raises(JobFailed, match="the test ends here"):
            ScriptedOperator(it.console, [TASK], None, None, 0).run()
        assert [command.action for command in it.robot.heard(Command)][:2] == [first, Action.ARM]


def test_a_job_that_the_robot_has_ended_fails_in_words_that_come_after_the_report(tmp_path: Path):
    with desk(tmp_path) as it:
        it.connected(ControlMode.STOPPED)
        late = threading.Timer(0.1, it.robot.event, ("stopped", "the control loop was 691 ms late"))
        late.start()
        with pytest.raises(JobFailed, match=r"on its own: .*691 ms late"):
            ScriptedTask(TASK, it.console, ScriptedActions(it.console, RealTime()), 0).result()
        late.join()
