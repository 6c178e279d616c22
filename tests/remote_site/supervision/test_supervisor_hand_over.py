"""The control of the robot goes from one site to another; what the robot does meanwhile."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.wire.messages import Heartbeat, Wish
from tests.messages import said
from tests.remote_site.bench import DT_S, Bench


class Two(Bench):
    """A second site, bob's, beside that of the bench."""

    def __init__(self, delay_s: float = 0.1) -> None:
        super().__init__(delay_s=delay_s)
        self.bobs_lease = ""

    def bob(self, wish: Wish = Wish.CONTROL) -> str:
        """Bob asks. Returns why he is not in control."""
        reply = self.ask_lease("session of bob", "bob", wish)
        self.bobs_lease = reply.lease_id if reply.granted else ""
        return said(reply)

    def bob_commands(self, action: Action) -> bool:
        return self.command(action, session="session of bob", lease_id=self.bobs_lease).accepted

    def hand_over(self) -> None:
        """Bob asks, ann is told, ann gives, bob learns it with his next request."""
        assert "held by ann" in self.bob(Wish.ASK)
        assert self.ask_lease().asked_by == "bob"
        assert "bob" in said(self.ask_lease(wish=Wish.GIVE))
        assert self.bob(Wish.ASK) == ""


def test_the_holder_is_told_who_asks_and_keeps_the_control_until_it_gives_it():
    bench = Two()
    bench.armed()
    for _ in range(5):
        assert "held by ann" in bench.bob(Wish.ASK)
        assert bench.ask_lease().granted
    assert not bench.bob_commands(Action.COUPLE)
    assert bench.command(Action.COUPLE).accepted


def test_after_the_hand_over_the_other_commands_and_the_one_before_is_told_who_does():
    bench = Two()
    bench.armed()
    bench.hand_over()
    refusal = bench.command(Action.COUPLE)
    assert not refusal.accepted and said(refusal) == "bob is in control"
    assert "held by bob" in said(bench.ask_lease())
    assert bench.bob_commands(Action.COUPLE)
    bench.run(DT_S, present=False)
    assert [said(e) for e in bench.events("control")] == ["ann is in control", "bob is in control"]


def test_driving_passes_through_hold_and_the_earlier_hand_moves_nothing_more():
    bench = Two()
    bench.coupled()
    bench.drive(1.2, 0.0)
    bench.drive(0.5, 0.3)
    assert bench.speed_m_s > 0.1
    earlier = bench.robot.motion.coupling
    assert earlier is not None
    bench.hand_over()
    bench.run(DT_S, present=False)
    assert bench.mode is ControlMode.HOLD
    (event,) = bench.events("decoupled")
    assert said(event) == "the lease was lost"
    bench.run(0.5, present=False)
    stands = bench.position_m
    assert bench.bob_commands(Action.COUPLE)
    for _ in range(20):
        bench.hand(0.9, 0.0, coupling_id=earlier.coupling_id, lease_id=earlier.lease_id)
        bench.hand(0.9, 0.0, lease_id=earlier.lease_id)
        bench.run(DT_S, present=False)
    np.testing.assert_array_equal(bench.position_m, stands)


@pytest.mark.parametrize("action", [Action.PAUSE, Action.ABORT])
def test_an_execution_goes_on_and_the_new_holder_may_end_it(action: Action):
    bench = Two()
    bench.executing()
    execution = bench.robot.motion.execution
    bench.hand_over()
    bench.run(0.5, present=False)
    assert bench.mode is ControlMode.AUTONOMOUS and bench.robot.motion.execution is execution
    assert not bench.command(action).accepted
    assert bench.bob_commands(action)
    assert bench.mode is (ControlMode.PAUSED if action is Action.PAUSE else ControlMode.HOLD)


def test_an_execution_arrives_with_nobody_in_control():
    bench = Two()
    bench.executing()
    bench.ask_lease(wish=Wish.WATCH)
    assert not bench.robot.contact.lease.lease_id
    bench.run(12.0, present=False)
    assert bench.robot.phase is Phase.ARRIVED


def test_a_watcher_never_commands_but_may_stop():
    bench = Two()
    bench.executing()
    assert bench.bob(Wish.WATCH) == "watching"
    assert not bench.bob_commands(Action.ABORT)
    bench.stop("bobs")
    assert bench.mode is ControlMode.STOPPED


def test_a_site_that_was_restarted_reclaims_its_own_at_once_and_must_couple_anew():
    bench = Two()
    bench.coupled()
    bench.drive(0.3, 0.0)
    before = bench.lease_id
    reply = bench.ask_lease("ann, started again", "ann")
    assert reply.granted and reply.lease_id != before
    bench.run(DT_S, present=False)
    assert bench.mode is ControlMode.HOLD
    assert "started again" in said(bench.ask_lease())
    assert bench.command(Action.COUPLE, session="ann, started again", lease_id=reply.lease_id).accepted


def test_a_command_that_an_outage_held_up_does_not_count_for_who_took_over_this_very_moment():
    bench = Two()
    bench.armed()
    bench.run(12.0)
    sent = bench.echo()
    bench.run(3.0)
    bench.ask_lease(wish=Wish.WATCH)
    assert bench.bob() == ""
    refusal = bench.command(
        Action.COUPLE, session="session of bob", lease_id=bench.bobs_lease, echo=sent
    )  # fmt: skip
    assert not refusal.accepted and "came too late" in said(refusal)
    assert bench.bob_commands(Action.COUPLE)


def test_an_old_holder_gets_the_control_back_unasked_if_nobody_took_it():
    bench = Two()
    bench.coupled()
    bench.run(4.0, present=False)
    assert bench.mode is ControlMode.HOLD and not bench.robot.contact.lease.lease_id
    assert bench.ask_lease().granted
    assert bench.command(Action.COUPLE).accepted


def test_after_the_hand_over_the_delay_of_the_new_holder_is_what_is_usual():
    bench = Two(delay_s=0.05)
    bench.armed()
    bench.run(12.0)
    bench.bob(Wish.ASK)
    bench.ask_lease(wish=Wish.GIVE)
    bench.delay_s = 4.0
    assert "held by bob" in said(bench.ask_lease())
    assert bench.bob() == ""
    assert bench.bob_commands(Action.COUPLE)


def test_a_lasting_rise_of_the_delay_ends_driving_with_that_reason():
    bench = Bench(delay_s=0.1).coupled()
    bench.run(5.0)
    bench.drive(0.5, 0.0)
    assert bench.mode is ControlMode.DIRECT
    bench.delay_s = 0.5  # within what the watchdog allows, beyond what a renewal may be
    for _ in range(12):
        bench.drive(1.0, 0.0)
    assert bench.mode is ControlMode.HOLD
    (event,) = bench.events("decoupled")
    assert said(event) == "link delay changed"
    assert bench.command(Action.COUPLE).accepted
    bench.drive(1.0, 0.0)
    assert bench.mode is ControlMode.DIRECT


def test_the_heartbeat_of_another_site_does_not_keep_the_coupling():
    bench = Bench().coupled()
    bench.run(1.0)
    for seq in range(60):
        bench.robot.contact.heartbeat(Heartbeat(session="session of bob", seq=seq, echo=bench.echo()))
        bench.run(DT_S, present=False)
    assert bench.mode is ControlMode.HOLD
