"""DIRECT: the robot follows the hand of who is there, and nobody else's."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire.messages import Event, Stamp
from tests.messages import said
from tests.remote_site.bench import DT_S, Bench, in_mode
from tests.remote_site.planar import TASK


def test_coupling_moves_nothing_until_the_hand_moves():
    bench = Bench().coupled()
    bench.drive(2.0, 0.3, 0.3)  # the first input anchors, wherever the hand is
    np.testing.assert_allclose(bench.position_m, TASK.start_m, atol=1e-9)


def test_a_coupled_robot_follows_the_difference_of_the_hand():
    bench = Bench().coupled()
    bench.drive(0.1, 0.5, 0.5)
    bench.drive(4.0, 0.7, 0.4)
    np.testing.assert_allclose(bench.position_m, TASK.start_m + np.array([0.2, -0.1]), atol=1e-3)


def test_the_first_second_is_slow():
    bench = Bench().coupled()
    bench.hand(0.0, 0.0)
    for _ in range(45):
        bench.drive(DT_S, 0.8)
        assert bench.speed_m_s <= 0.2 * TASK.limits.speed_m_s + 1e-9
    bench.drive(0.5, 0.8)
    assert bench.speed_m_s > 0.5 * TASK.limits.speed_m_s


def test_inputs_with_another_coupling_or_lease_move_nothing():
    bench = Bench().coupled()
    bench.drive(0.1, 0.0)
    first = bench.robot.motion.coupling
    bench.command(Action.CLUTCH)
    bench.command(Action.COUPLE)
    bench.drive(0.1, 0.0)
    refused = bench.robot.contact.stale_refused
    assert first is not None
    for wrong in ({"coupling_id": first.coupling_id}, {"lease_id": "made up"}, {"coupling_id": 0}):
        for _ in range(20):
            bench.hand(0.5, 0.0, **wrong)
            bench.run(DT_S)
    np.testing.assert_allclose(bench.position_m, TASK.start_m, atol=1e-9)
    assert bench.robot.contact.stale_refused == refused + 60


def test_an_old_input_moves_nothing():
    bench = Bench().coupled()
    bench.run(1.2)
    bench.drive(0.1, 0.0)
    old = Stamp(bench.clock.boot, bench.time.ns - 2_000_000_000)
    for _ in range(20):
        bench.hand(0.5, 0.0, echo=old)
        bench.run(DT_S)
    np.testing.assert_allclose(bench.position_m, TASK.start_m, atol=1e-9)


@pytest.mark.parametrize("mode", [m for m in ControlMode if m is not ControlMode.DIRECT])
def test_the_hand_moves_nothing_while_decoupled(mode: ControlMode):
    bench, undisturbed = in_mode(mode), in_mode(mode)
    for _ in range(50):
        bench.hand(0.9, 0.9)
        bench.hand(0.9, 0.1, coupling_id=1)
        bench.run(DT_S)
        undisturbed.run(DT_S)
    np.testing.assert_array_equal(bench.position_m, undisturbed.position_m)


def test_without_input_for_half_a_second_the_robot_stops_and_stays_coupled():
    bench = Bench().coupled()
    bench.run(1.0)
    bench.drive(0.1, 0.0)
    bench.drive(0.3, 0.8)
    assert bench.speed_m_s > 0.1
    bench.run(0.5)
    bench.run(0.5)
    coupling = bench.robot.motion.coupling
    assert bench.mode is ControlMode.DIRECT and coupling is not None
    assert coupling.waiting(bench.clock.now_s()) and bench.speed_m_s < 1e-6
    stands = bench.position_m
    bench.drive(2.0, 0.2, 0.9)  # anchors anew: no jump to where the hand is now
    np.testing.assert_allclose(bench.position_m, stands, atol=1e-9)


def test_letting_go_ends_the_coupling():
    bench = Bench().coupled()
    bench.drive(0.3, 0.0)
    bench.hand(0.0, 0.0, released=True)
    bench.run(DT_S)
    assert bench.mode is ControlMode.HOLD
    (event,) = bench.events("decoupled")
    assert event.succeeded  # as the operator wanted it


def test_ten_seconds_without_input_end_the_coupling():
    bench = Bench().coupled()
    bench.run(9.9)
    assert bench.mode is ControlMode.DIRECT
    bench.run(0.3)
    assert bench.mode is ControlMode.HOLD
    (event,) = bench.events("decoupled")
    assert not event.succeeded


@pytest.mark.parametrize("delay_s", [0.02, 0.6, 2.0])
def test_half_a_second_of_silence_beyond_the_usual_delay_ends_driving(delay_s: float):
    bench = Bench(delay_s=delay_s).coupled()
    bench.run(3.0)
    bench.drive(0.5, 0.0)
    bench.drive(1.0, 0.8)
    assert bench.mode is ControlMode.DIRECT
    bench.run(0.36, present=False)
    assert bench.mode is ControlMode.DIRECT
    bench.run(0.2, present=False)
    assert bench.mode is ControlMode.HOLD
    assert any(e.kind == "decoupled" and "0.5 s" in said(e) for e in bench.heard(Event))
    bench.run(0.5, present=False)
    assert bench.speed_m_s < 1e-6


def test_stamps_that_were_never_given_out_do_not_quieten_the_watchdog():
    bench = Bench().coupled()
    bench.run(1.5)
    bench.delay_s = -100.0
    bench.run(0.7)
    assert bench.mode is ControlMode.HOLD


def test_the_operator_who_comes_back_after_an_outage_must_couple_again():
    bench = Bench().coupled()
    bench.drive(0.2, 0.0)
    coupling = bench.robot.motion.coupling
    assert coupling is not None
    bench.run(5.0, present=False)
    stands = bench.position_m
    bench.ask_lease()
    for _ in range(20):
        bench.hand(0.8, 0.0, coupling_id=coupling.coupling_id)
        bench.run(DT_S)
    assert bench.mode is ControlMode.HOLD
    np.testing.assert_array_equal(bench.position_m, stands)
