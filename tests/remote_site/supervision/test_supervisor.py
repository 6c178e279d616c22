"""The lease, commands, stops and resets, on the whole supervisor in virtual time."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire import keys
from farhand.common.wire.messages import Event, Stamp, StopAck
from tests.messages import said
from tests.remote_site.bench import DT_S, Bench, in_mode
from tests.remote_site.planar import TASK

every_mode = pytest.mark.parametrize("mode", ControlMode)
NOT_STOPPED = [mode for mode in ControlMode if mode is not ControlMode.STOPPED]


def test_a_robot_starts_disarmed_and_stays_where_it_is():
    bench = Bench()
    bench.run(2.0, present=False)
    assert bench.mode is ControlMode.DISARMED
    np.testing.assert_array_equal(bench.position_m, TASK.start_m)


def test_arming_moves_nothing_and_is_answered_twice():
    bench = Bench()
    bench.ask_lease()
    reply = bench.command(Action.ARM)
    assert reply.accepted and reply.mode is ControlMode.HOLD
    bench.run(0.5)
    ending = bench.ending(reply.command_id)
    assert ending is not None and ending.kind == "completed"
    np.testing.assert_array_equal(bench.position_m, TASK.start_m)


def test_nobody_moves_anything_without_the_lease():
    bench = Bench()
    assert not bench.command(Action.ARM, lease_id="").accepted
    bench.ask_lease()
    refusal = bench.command(Action.ARM, lease_id="made up")
    assert not refusal.accepted and "it is back: press again" in said(refusal)
    another = bench.command(Action.ARM, session="another")
    assert not another.accepted and said(another) == "ann is in control"
    assert bench.mode is ControlMode.DISARMED


@pytest.mark.parametrize(
    "action", sorted(set(Action) - {Action.ARM, Action.STOP, Action.DISARM, Action.SET_PACE})
)
def test_a_disarmed_robot_does_nothing_but_be_armed(action: Action):
    bench = Bench()
    bench.ask_lease()
    refusal = bench.command(action, model_sha256=bench.send_model().sha256)
    assert not refusal.accepted and "DISARMED" in said(refusal)
    assert bench.mode is ControlMode.DISARMED


def test_a_command_of_another_boot_is_refused():
    bench = Bench()
    bench.ask_lease()
    refusal = bench.command(Action.ARM, echo=Stamp("older", bench.time.ns))
    assert not refusal.accepted and "another boot" in said(refusal)


def test_a_command_without_an_echo_is_refused():
    bench = Bench()
    bench.ask_lease()
    assert not bench.command(Action.ARM, echo=None).accepted


def test_what_waited_out_an_outage_is_refused_with_its_age():
    bench = Bench().armed()
    bench.run(2.0)
    sent = bench.echo()
    bench.run(2.0)
    refusal = bench.command(Action.COUPLE, echo=sent)
    assert not refusal.accepted and refusal.measured == pytest.approx(2.1)
    assert bench.mode is ControlMode.HOLD


def test_a_command_runs_once_however_often_it_arrives():
    bench = Bench().armed()
    first = bench.command(Action.COUPLE, command_id="again")
    coupling = bench.robot.motion.coupling
    bench.run(0.1)
    bench.command(Action.CLUTCH)
    assert bench.command(Action.COUPLE, command_id="again") == first
    assert bench.mode is ControlMode.HOLD and bench.robot.motion.coupling is None
    assert coupling is not None
    assert sum(e.coupling_id == coupling.coupling_id for e in bench.heard(Event)) == 1


def test_a_command_that_another_overtakes_gets_its_second_answer_all_the_same():
    bench = Bench().executing()
    bench.run(0.5)
    aborted = bench.command(Action.ABORT)
    execute = bench.command(Action.EXECUTE, model_sha256=bench.send_model().sha256)
    assert aborted.accepted and execute.accepted
    bench.stop()
    bench.run(1.0)
    (answer,) = [e for e in bench.heard(Event) if e.command_id == aborted.command_id]
    assert not answer.succeeded and "execute" in said(answer)


def test_a_refused_command_stays_refused_when_it_arrives_again():
    bench = Bench()
    bench.ask_lease()
    first = bench.command(Action.COUPLE, command_id="early")
    bench.command(Action.ARM)
    assert not first.accepted
    assert bench.command(Action.COUPLE, command_id="early") == first
    assert bench.mode is ControlMode.HOLD


@every_mode
def test_stop_comes_from_every_mode_without_a_lease_and_is_acknowledged_twice(mode: ControlMode):
    bench = in_mode(mode)
    bench.said.clear()
    bench.stop("mine")
    assert bench.mode is ControlMode.STOPPED
    assert [a.standing for a in bench.heard(StopAck)] == [False]
    bench.run(1.0, present=False)
    assert [a.standing for a in bench.heard(StopAck) if a.stop_id == "mine"] == [False, True]
    assert {channel for channel, m in bench.said if isinstance(m, StopAck)} == {keys.STOP_ACK}
    assert bench.speed_m_s < 2e-3


def test_the_robot_stands_when_it_says_so():
    bench = Bench().executing()
    bench.run(1.0)
    assert bench.speed_m_s > 0.05
    bench.stop()
    while not any(a.standing for a in bench.heard(StopAck)):
        bench.run(DT_S)
    assert bench.speed_m_s <= 2e-3


@pytest.mark.parametrize("action", sorted(set(Action) - {Action.RESET, Action.STOP}))
def test_nothing_but_reset_leaves_stopped(action: Action):
    bench = Bench().stopped()
    accepted = bench.command(action, model_sha256=bench.send_model().sha256).accepted
    assert accepted is (action is Action.SET_PACE)  # which moves nothing: it is for what comes later
    assert bench.mode is ControlMode.STOPPED


def test_reset_leads_to_disarmed_and_moves_nothing():
    bench = Bench().executing()
    bench.stop()
    bench.run(1.0)
    stands = bench.position_m
    assert bench.command(Action.RESET).accepted
    assert bench.mode is ControlMode.DISARMED
    bench.run(1.0)
    np.testing.assert_array_equal(bench.position_m, stands)


def test_a_stop_that_arrives_again_after_the_reset_stops_again():
    bench = Bench().stopped()
    bench.command(Action.RESET)
    bench.stop()
    assert bench.mode is ControlMode.STOPPED


@pytest.mark.parametrize("mode", NOT_STOPPED)
def test_disarm_comes_from_every_mode_but_stopped(mode: ControlMode):
    bench = in_mode(mode)
    bench.ask_lease()
    assert bench.command(Action.DISARM).accepted
    bench.run(1.0)
    assert bench.mode is ControlMode.DISARMED and bench.speed_m_s < 1e-6
