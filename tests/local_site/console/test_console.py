"""The console over a link in memory: it shows what the robot said, and asks for what the operator wants."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire import keys
from farhand.common.wire.messages import (
    Command,
    ModelTransfer,
    MoveTarget,
    OperatorInput,
    PlannedPath,
    Stamp,
    Stop,
    StopAck,
)
from farhand.common.wire.reasons import Code, because, in_words
from farhand.local_site.console import intents
from tests.local_site.robot_end import LEASE_ID, Desk, desk, stroke


def a_path(plan_id: int = 0, path_id: int = 1, sha256: str = "a" * 64) -> PlannedPath:
    return PlannedPath(
        path_id=path_id, plan_id=plan_id, stamp=Stamp("boot", 1), model_sha256=sha256, n_coordinates=2,
        step_s=0.1, points=bytes(16), reaches_end=True,
    )  # fmt: skip


def teach(it: Desk) -> None:
    n = it.picture.n_demonstrations
    it.console.submit(intents.RecordDemonstration())
    for position, time_s in zip(*stroke(), strict=True):
        it.console.submit(intents.Hand(tuple(position.tolist()), float(time_s)))
    it.console.submit(intents.EndDemonstration())
    it.until(lambda p: p.n_demonstrations == n + 1)


def test_before_the_robot_reports_nothing_is_known_and_nothing_can_be_asked(tmp_path: Path):
    with desk(tmp_path) as it:
        assert it.picture.robot is None and it.picture.mode is None and not it.picture.in_control
        it.console.submit(intents.CommandRobot(Action.ARM))
        it.told("arm: refused: the robot has not reported")
        assert not it.robot.heard(Command)


def test_the_mode_is_the_robots_word_and_nothing_else(tmp_path: Path):
    with desk(tmp_path) as it:
        it.connected(ControlMode.DISARMED)
        it.console.submit(intents.CommandRobot(Action.ARM))
        it.until(lambda p: (a := p.pending.get(Action.ARM)) is not None and a.accepted_ns is not None)
        assert it.picture.mode is ControlMode.DISARMED
        it.robot.report(ControlMode.HOLD)
        it.until(lambda p: p.mode is ControlMode.HOLD and not p.pending)


def test_a_report_that_was_overtaken_is_not_shown(tmp_path: Path):
    with desk(tmp_path) as it:
        it.connected(ControlMode.HOLD, seq=20)
        it.robot.report(ControlMode.DIRECT, seq=19)
        it.robot.event("sent", "after it")
        assert it.told("after it").mode is ControlMode.HOLD
        it.robot.report(ControlMode.STOPPED, seq=21)
        assert it.until(lambda p: p.mode is ControlMode.STOPPED).link.n_received == 2


def test_rubbish_on_the_wire_is_dropped(tmp_path: Path):
    with desk(tmp_path) as it:
        for channel in (keys.TELEMETRY, keys.EVENT, keys.PATH, keys.STOP_ACK):
            it.robot._link.send(channel, b"rubbish")
        it.connected(ControlMode.HOLD)


def test_a_click_on_an_old_page_is_refused_before_it_leaves(tmp_path: Path):
    with desk(tmp_path) as it:
        it.connected(ControlMode.HOLD)
        it.console.submit(intents.CommandRobot(Action.COUPLE, shown_mode=ControlMode.DISARMED))
        it.told("page was behind")
        assert not it.robot.heard(Command)


def test_a_demonstration_is_learned_sent_and_confirmed_and_then_named_in_commands(tmp_path: Path):
    with desk(tmp_path) as it:
        it.connected(ControlMode.HOLD)
        teach(it)
        learned = it.picture.learned
        assert learned is not None and len(it.picture.strokes) == 1
        assert not it.picture.confirmed_sha256
        it.console.submit(intents.SendModel())
        it.until(lambda p: p.confirmed_sha256 == learned.sha256 and not p.sending_model)
        (transfer,) = it.robot.heard(ModelTransfer)
        assert (transfer.content, transfer.task) == (learned.content, "planar")
        it.robot.say(keys.PATH, a_path(plan_id=5, sha256=learned.sha256))  # one of another model is forgotten
        it.until(lambda p: p.plan_id == 5)
        it.console.submit(intents.CommandRobot(Action.EXECUTE))
        (command,) = it.robot.wait_for(Command)
        assert (command.model_sha256, command.plan_id) == (learned.sha256, 5)


def test_a_model_that_the_robot_refuses_is_not_confirmed(tmp_path: Path):
    with desk(tmp_path) as it:
        it.connected(ControlMode.HOLD)
        teach(it)
        it.robot.refusal = in_words("it does not fit")
        it.console.submit(intents.SendModel())
        it.told("refused: it does not fit")
        assert not it.picture.confirmed_sha256


def test_a_model_that_the_robot_has_lost_can_be_sent_again(tmp_path: Path):
    with desk(tmp_path) as it:
        it.connected(ControlMode.HOLD)
        teach(it)
        it.console.submit(intents.SendModel())
        it.until(lambda p: bool(p.confirmed_sha256))
        it.console.submit(intents.SendModel())
        it.told("refused: the robot has it already")
        it.robot.refusal = because(Code.NO_SUCH_MODEL, model="ab")
        it.console.submit(intents.CommandRobot(Action.PREVIEW))
        it.until(lambda p: p.standing.differs)
        it.robot.refusal = None
        it.console.submit(intents.SendModel())
        it.until(lambda p: bool(p.confirmed_sha256))


def test_undo_takes_back_the_last_demonstration(tmp_path: Path):
    with desk(tmp_path) as it:
        teach(it)
        teach(it)
        it.console.submit(intents.Undo())
        it.until(lambda p: p.n_demonstrations == 1)
        it.console.submit(intents.Undo())
        it.until(lambda p: p.learned is None and not p.can_undo)
        it.console.submit(intents.Undo())
        it.told("undo: refused")


def test_the_samples_of_the_task_are_learned_on_request(tmp_path: Path):
    with desk(tmp_path) as it:
        it.console.submit(intents.LoadSamples())
        it.until(lambda p: p.n_demonstrations == 3)


@pytest.mark.parametrize("intent", [intents.EndDemonstration(), intents.Undo(), intents.SendModel()])
def test_what_is_not_possible_now_is_refused_in_words_and_changes_nothing(tmp_path: Path, intent):
    with desk(tmp_path) as it:
        it.connected(ControlMode.HOLD)
        it.console.submit(intent)
        it.told("refused")
        assert not it.robot.heard(ModelTransfer) and not it.picture.recording


def test_while_coupled_the_hand_drives_and_record_is_the_robots(tmp_path: Path):
    with desk(tmp_path) as it:
        report = it.connected(ControlMode.DIRECT, coupling_id=4).picture.robot
        assert report is not None
        it.console.submit(intents.RecordDemonstration())
        (command,) = it.robot.wait_for(Command)
        assert command.action is Action.RECORD
        it.console.submit(intents.Hand((0.3, 0.4), 1.0))
        it.console.submit(intents.Hand((0.3, 0.4), 1.1, released=True))
        first, second = it.robot.wait_for(OperatorInput, 2)
        assert (first.position_m, first.coupling_id, first.lease_id) == ((0.3, 0.4), 4, LEASE_ID)
        assert first.echo == report.stamp
        assert (first.released, second.released) == (False, True)
        assert not it.picture.recording and it.picture.n_demonstrations == 0


def test_while_decoupled_the_hand_is_not_sent(tmp_path: Path):
    with desk(tmp_path) as it:
        it.connected(ControlMode.HOLD)
        it.console.submit(intents.Hand((0.3, 0.4), 1.0))
        teach(it)
        assert not it.robot.heard(OperatorInput)


def test_the_stroke_under_way_is_shown_last(tmp_path: Path):
    with desk(tmp_path) as it:
        teach(it)
        it.console.submit(intents.RecordDemonstration())
        it.console.submit(intents.Hand((0.3, 0.4), 0.0))
        picture = it.until(lambda p: len(p.strokes) == 2)
        np.testing.assert_array_equal(picture.strokes[1], [[0.3, 0.4]])
        assert picture.recording and picture.forming is None
        it.console.submit(intents.Hand((0.4, 0.4), 0.02))
        assert it.until(lambda p: p.forming is not None).recording


def test_stop_needs_neither_report_nor_lease_and_is_resent_until_it_is_answered(tmp_path: Path):
    with desk(tmp_path) as it:
        it.console.submit(intents.CommandRobot(Action.STOP))
        stops = it.robot.wait_for(Stop, 3)
        assert len({stop.stop_id for stop in stops}) == 1 and stops[0].site_name == "ann"
        it.robot.say(keys.STOP_ACK, StopAck(stop_id=stops[0].stop_id, standing=False, stamp=it.robot.now()))
        it.until(lambda p: p.stop is not None and p.stop.received and not p.stop.standing)
        it.robot.say(keys.STOP_ACK, StopAck(stop_id=stops[0].stop_id, standing=True, stamp=it.robot.now()))
        it.until(lambda p: p.stop is not None and p.stop.standing)


def test_reset_is_refused_while_the_own_stop_is_not_acknowledged(tmp_path: Path):
    with desk(tmp_path) as it:
        it.connected(ControlMode.STOPPED)
        it.console.submit(intents.CommandRobot(Action.STOP))
        it.console.submit(intents.CommandRobot(Action.RESET))
        it.told("reset: refused: your own stop")
        assert not it.robot.heard(Command)


def test_after_a_restart_of_the_robot_models_and_plans_are_unconfirmed(tmp_path: Path):
    with desk(tmp_path) as it:
        it.connected(ControlMode.HOLD)
        teach(it)
        it.console.submit(intents.SendModel())
        confirmed = it.until(lambda p: bool(p.confirmed_sha256)).confirmed_sha256
        it.robot.say(keys.PATH, a_path(plan_id=5, sha256=confirmed))
        it.until(lambda p: p.plan_id == 5)
        it.robot.restart()
        it.robot.report()
        picture = it.told("the robot was restarted")
        assert (picture.confirmed_sha256, picture.plan_id, picture.path) == ("", 0, None)
        assert picture.mode is ControlMode.DISARMED and picture.learned is not None


def test_a_path_of_the_execution_keeps_the_number_of_the_last_preview(tmp_path: Path):
    with desk(tmp_path) as it:
        it.robot.say(keys.PATH, a_path(plan_id=5, path_id=1))
        it.robot.say(keys.PATH, a_path(plan_id=0, path_id=2))
        picture = it.until(lambda p: p.path is not None and p.path.path_id == 2)
        assert picture.plan_id == 5


def test_what_the_robot_reports_is_told(tmp_path: Path):
    with desk(tmp_path) as it:
        it.robot.event("decoupled", "the lease was lost", succeeded=False)
        picture = it.told("decoupled: the lease was lost")
        assert not picture.notices[-1].good


def test_moving_the_target_is_passed_on_with_the_lease(tmp_path: Path):
    with desk(tmp_path) as it:
        robot = it.connected(ControlMode.HOLD).picture.robot
        assert robot is not None
        it.console.submit(intents.DragTarget((0.2, 0.3)))
        (move,) = it.robot.wait_for(MoveTarget)
        assert move == MoveTarget(echo=robot.stamp, lease_id=LEASE_ID, position_m=(0.2, 0.3))


def test_one_bad_intent_does_not_take_the_console_away(tmp_path: Path):
    with desk(tmp_path) as it:
        it.console.submit(intents.RecordDemonstration())
        it.console.submit(intents.Hand(("not", "numbers"), 0.0))  # pyright: ignore[reportArgumentType]
        it.console.submit(intents.Hand((np.nan, 0.0), 0.0))
        it.told("hand: refused")
        it.console.submit(intents.Hand((0.3, 0.4), 0.0))
        it.until(lambda p: len(p.strokes) == 1)


class OnceSuspended:
    """A watch that notices one suspend, when it is told."""

    def __init__(self) -> None:
        self.length_s = 0.0

    def suspended_s(self) -> float:
        length_s, self.length_s = self.length_s, 0.0
        return length_s


def test_after_a_suspend_nothing_is_asked_again_but_a_stop_is_resent(
    tmp_path: Path,
):
    with desk(tmp_path) as it:
        watch = OnceSuspended()
        it.console._suspend = watch  # pyright: ignore[reportAttributeAccessIssue]
        it.connected(ControlMode.HOLD)
        it.link.cut()
        it.console.submit(intents.CommandRobot(Action.COUPLE))
        it.console.submit(intents.CommandRobot(Action.STOP))
        it.until(lambda p: Action.COUPLE in p.pending)
        watch.length_s = 60.0
        picture = it.told("this computer was suspended for 60 s")
        assert not picture.pending
        it.link.mend()
        assert len({stop.stop_id for stop in it.robot.wait_for(Stop, 2)}) == 1
        assert not it.robot.heard(Command)
