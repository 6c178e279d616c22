"""Two real consoles and one real robot: the control asked for, given, watched, reclaimed, and lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.wire.messages import Wish
from farhand.common.wire.reason_words import sentence
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.stop_sender import StopStatus
from tests.meeting import Meeting, Site


@pytest.fixture
def meeting() -> Meeting:
    return Meeting()


@pytest.fixture
def ann(meeting: Meeting, tmp_path: Path) -> Site:
    return meeting.join("ann", tmp_path / "ann")


@pytest.fixture
def bob(meeting: Meeting, ann: Site, tmp_path: Path) -> Site:
    return meeting.join("bob", tmp_path / "bob")


def hand_over(meeting: Meeting, ann: Site, bob: Site) -> None:
    bob.wants(Wish.ASK)
    meeting.run(1.5)  # ann is told with her next renewal
    ann.wants(Wish.GIVE)
    meeting.run(1.5)


def execute(site: Site) -> ConsoleState:
    return site.ask(intents.LoadSamples(), intents.SendModel(), Action.ARM, Action.EXECUTE)


def test_the_first_is_in_control_and_the_second_is_told_by_whom(ann: Site, bob: Site):
    assert ann.picture.in_control and not bob.picture.in_control
    assert "held by ann" in sentence(bob.picture.why_not_in_control)
    bob.ask(Action.ARM)
    assert bob.told("arm: refused: ann is in control")


def test_it_is_asked_for_given_and_then_the_other_watches(meeting: Meeting, ann: Site, bob: Site):
    hand_over(meeting, ann, bob)
    assert ann.told("control: bob asks for the control")
    assert bob.picture.in_control and not ann.picture.in_control
    assert ann.picture.wish is Wish.WATCH and bob.picture.wish is Wish.CONTROL
    assert ann.told("bob is in control") and bob.told("bob is in control")
    bob.ask(Action.ARM)
    meeting.run(10.0)
    assert meeting.mode is ControlMode.HOLD and bob.picture.in_control


def test_who_gave_it_does_not_take_it_back_when_the_other_goes_until_it_wants_to(
    meeting: Meeting, ann: Site, bob: Site
):
    hand_over(meeting, ann, bob)
    meeting.leave(bob)
    meeting.run(5.0)
    assert not ann.picture.in_control
    ann.wants(Wish.CONTROL)
    meeting.run(1.5)
    assert ann.picture.in_control


def test_an_observer_sees_everything_commands_nothing_and_may_stop(
    meeting: Meeting, ann: Site, tmp_path: Path
):
    eve = meeting.join("eve", tmp_path / "eve", Wish.WATCH)
    execute(ann)
    assert eve.picture.mode is ControlMode.AUTONOMOUS and eve.picture.path is not None
    eve.ask(Action.ABORT)
    assert meeting.mode is ControlMode.AUTONOMOUS
    eve.ask(Action.STOP)
    assert meeting.mode is ControlMode.STOPPED
    assert eve.picture.stop is not None and eve.picture.stop.settled
    assert ann.told("stopped: stop by eve")


def stop_of(site: Site) -> StopStatus:
    assert site.picture.stop is not None
    return site.picture.stop


def test_a_stop_whose_answer_is_held_up_goes_on_stopping_whoever_resets_the_robot(
    meeting: Meeting, ann: Site, tmp_path: Path
):
    eve = meeting.join("eve", tmp_path / "eve", Wish.WATCH)
    execute(ann)
    eve.link.deaf = True
    eve.ask(Action.STOP)
    assert meeting.mode is ControlMode.STOPPED and not stop_of(eve).received
    ann.ask(Action.RESET, Action.ARM, Action.EXECUTE)  # while eve's is resent, it does not come far
    assert meeting.mode is ControlMode.STOPPED and not stop_of(eve).settled
    eve.link.mend()
    meeting.run(0.5)
    assert stop_of(eve).settled
    ann.ask(Action.RESET)
    assert meeting.mode is ControlMode.DISARMED


def test_every_press_stops_a_robot_that_was_reset_while_the_way_back_was_held_up(
    meeting: Meeting, ann: Site, tmp_path: Path
):
    eve = meeting.join("eve", tmp_path / "eve", Wish.WATCH)
    execute(ann)
    for _ in range(6):
        eve.link.deaf = True
        eve.ask(Action.STOP)
        assert meeting.mode is ControlMode.STOPPED
        eve.link.stalled = True  # nor does the resending get through
        ann.ask(Action.RESET, Action.ARM, Action.EXECUTE)
        assert meeting.mode is ControlMode.AUTONOMOUS
        eve.link.stalled = False
        eve.ask(Action.STOP)
        assert meeting.mode is ControlMode.STOPPED
        eve.link.mend()
        meeting.run(0.5)
        assert stop_of(eve).settled
        ann.ask(Action.RESET, Action.ARM, Action.EXECUTE)
        assert meeting.mode is ControlMode.AUTONOMOUS


def test_an_acknowledgement_of_the_past_is_shown_beside_what_the_robot_does_now(
    meeting: Meeting, ann: Site, tmp_path: Path
):
    eve = meeting.join("eve", tmp_path / "eve", Wish.WATCH)
    execute(ann)
    eve.link.deaf = True
    eve.console.submit(intents.CommandRobot(Action.STOP))
    meeting.run(0.1)  # heard, and not resent yet
    assert meeting.mode is ControlMode.STOPPED
    eve.link.cut()
    meeting.run(0.5)
    ann.ask(Action.RESET, Action.ARM, Action.EXECUTE)
    eve.link.mend()  # what had waited, and then what the robot says now
    meeting.run(0.1)
    assert stop_of(eve).standing and stop_of(eve).moves_again and not stop_of(eve).settled
    eve.ask(Action.STOP)
    assert meeting.mode is ControlMode.STOPPED and stop_of(eve).settled


@pytest.mark.parametrize("at", ["first", "later"])
def test_a_site_that_hears_nothing_has_lost_the_control_to_the_other_one_within_four_seconds(
    meeting: Meeting, tmp_path: Path, at: str
):
    ann = meeting.join("ann", tmp_path / "ann")
    meeting.run(1.0 if at == "first" else 20.0)
    bob = meeting.join("bob", tmp_path / "bob")
    meeting.run(5.0)
    lease = meeting.robot.supervisor.contact.lease
    assert lease.holder == "ann"
    ann.link.deaf = True
    meeting.run(4.0)
    assert lease.holder == "bob" and bob.picture.in_control
    for _ in range(60):
        meeting.run(1.0)
        assert lease.holder == "bob"
    ann.link.mend()
    bob.link.deaf = True
    meeting.run(4.0)
    assert lease.holder == "ann" and ann.picture.in_control


def test_a_site_that_never_hears_the_robot_has_it_only_until_another_one_asks(
    meeting: Meeting, tmp_path: Path
):
    ann = meeting.join("ann", tmp_path / "ann")
    ann.link.deaf = True
    lease = meeting.robot.supervisor.contact.lease
    meeting.leave(ann)
    meeting.run(4.0)
    deaf = Site(meeting, "deaf", tmp_path / "deaf", Wish.CONTROL)
    deaf.link.deaf = True
    meeting.sites.append(deaf)
    meeting.run(2.0)
    assert lease.holder == "deaf"
    bob = meeting.join("bob", tmp_path / "bob")
    meeting.run(1.5)
    assert lease.holder == "bob" and bob.picture.in_control
    meeting.run(30.0)
    assert lease.holder == "bob"


def test_driving_passes_through_hold_and_the_new_holder_couples_anew(meeting: Meeting, ann: Site, bob: Site):
    ann.ask(Action.ARM, Action.COUPLE)
    ann.drive(1.5, 0.3, 0.3)
    ann.drive(0.5, 0.5, 0.3)
    assert meeting.mode is ControlMode.DIRECT
    modes = set()
    bob.wants(Wish.ASK)
    for _ in range(3):
        ann.drive(0.5, 0.5, 0.3)
    ann.console.submit(intents.WishControl(Wish.GIVE))
    for _ in range(100):
        ann.drive(0.02, 0.9, 0.9)
        modes.add(meeting.mode)
    assert modes <= {ControlMode.DIRECT, ControlMode.HOLD} and meeting.mode is ControlMode.HOLD
    stands = meeting.position_m
    bob.ask(Action.COUPLE)
    ann.drive(1.0, 0.1, 0.9)
    np.testing.assert_array_equal(meeting.position_m, stands)
    bob.drive(1.5, 0.5, 0.5)
    bob.drive(2.0, 0.6, 0.5)
    np.testing.assert_allclose(meeting.position_m - stands, [0.1, 0.0], atol=2e-3)


@pytest.mark.parametrize(
    ("action", "mode"), [(Action.PAUSE, ControlMode.PAUSED), (Action.ABORT, ControlMode.HOLD)]
)
def test_an_execution_goes_on_through_the_hand_over_and_the_new_holder_may_end_it(
    meeting: Meeting, ann: Site, bob: Site, action: Action, mode: ControlMode
):
    execute(ann)
    execution = meeting.robot.supervisor.motion.execution
    hand_over(meeting, ann, bob)
    assert meeting.robot.supervisor.motion.execution is execution
    assert meeting.mode is ControlMode.AUTONOMOUS
    bob.ask(action)
    assert meeting.mode is mode


def test_a_restarted_site_shows_the_robots_mode_and_has_its_control_back_at_once(
    meeting: Meeting, ann: Site, bob: Site, tmp_path: Path
):
    ann.ask(Action.ARM, Action.COUPLE)
    ann.drive(0.5, 0.3, 0.3)
    meeting.leave(ann)
    again = meeting.join("ann", tmp_path / "ann")
    assert again.picture.in_control and not bob.picture.in_control
    assert again.picture.mode is ControlMode.HOLD  # coupling is new
    assert not again.picture.pending


def test_the_control_is_free_after_the_lease_and_goes_to_who_wants_it(meeting: Meeting, ann: Site, bob: Site):
    ann.link.cut()
    meeting.run(2.5)
    assert not bob.picture.in_control
    meeting.run(2.5)
    assert bob.picture.in_control
    ann.link.mend()
    meeting.run(3.0)
    assert not ann.picture.in_control and "held by bob" in sentence(ann.picture.why_not_in_control)


def test_events_that_an_outage_has_swallowed_are_told_once_each_and_in_order(
    meeting: Meeting, ann: Site, tmp_path: Path
):
    bob = meeting.join("bob", tmp_path / "bob", Wish.WATCH)
    ann.ask(Action.ARM)
    bob.link.cut()
    ann.ask(Action.COUPLE, Action.CLUTCH, Action.COUPLE, Action.CLUTCH, Action.DISARM)
    meeting.run(3.0)
    bob.link.mend()
    meeting.run(1.0)
    told = [(n.what, n.text) for n in bob.picture.notices]
    expected = ["couple", "clutch", "couple", "clutch", "disarm"]
    assert [what for what, text in told if what in expected] == expected
    ann.ask(Action.ARM)
    assert [what for what, _ in [(n.what, n.text) for n in bob.picture.notices]].count("arm") == 2


def test_a_robot_that_was_restarted_stays_where_it_was_disarmed_and_says_what_was_interrupted(
    meeting: Meeting, ann: Site
):
    execute(ann)
    meeting.run(0.5)
    stopped_at = meeting.position_m
    meeting.restart_robot()
    meeting.run(3.0)
    assert meeting.mode is ControlMode.DISARMED
    assert meeting.robot.supervisor.phase is Phase.NONE
    np.testing.assert_array_equal(meeting.position_m, stopped_at)
    sha256 = ann.picture.learned.sha256 if ann.picture.learned else ""
    assert ann.told(f"interrupted: the execution of {sha256[:8]} was interrupted")
    assert ann.picture.in_control and not ann.picture.confirmed_sha256
    execute(ann)
    assert meeting.mode is ControlMode.AUTONOMOUS
