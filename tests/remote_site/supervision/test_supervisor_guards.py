"""Force, sight, the link and faults, on the whole supervisor in virtual time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from msgspec import structs

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.wire.messages import Event
from tests.messages import said
from tests.remote_site.bench import BEGINNINGS, DT_S, Bench, FeelingPlant
from tests.remote_site.planar import TASK

MOVING = (ControlMode.DIRECT, ControlMode.AUTONOMOUS)


def until(bench: Bench, mode: ControlMode, at_most_s: float = 20.0, present: bool = True) -> float:
    """Run until the robot is in a mode. Returns how long that took [s]."""
    for tick in range(round(at_most_s / DT_S)):
        if bench.mode is mode:
            return tick * DT_S
        bench.run(DT_S, present)
    raise AssertionError(f"{bench.mode} after {at_most_s} s")


def feeling(mode: ControlMode = ControlMode.AUTONOMOUS) -> tuple[Bench, FeelingPlant]:
    plant = FeelingPlant()
    bench = Bench(plant=plant)
    BEGINNINGS[mode](bench)
    return bench, plant


# Force ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", MOVING)
@pytest.mark.parametrize(("force_n", "after_s"), [(260.0, 0.05), (450.0, 0.0)])
def test_too_much_force_backs_off_two_centimetres_at_most_and_holds(mode, force_n, after_s):
    bench, plant = feeling(mode)
    plant.force_n = np.array([0.0, force_n])
    took_s = 0.0
    while bench.robot.phase is not Phase.BACKING_OFF:
        bench.run(DT_S)
        took_s += DT_S
    assert took_s <= after_s + 1.01 * DT_S
    assert bench.mode is ControlMode.AUTONOMOUS and bench.robot.motion.coupling is None
    began = bench.robot.sensing.effector.position_m
    plant.force_n = np.zeros(2)
    assert until(bench, ControlMode.HOLD) <= 2.0
    bench.run(1.0)
    back = bench.position_m - began
    assert bench.speed_m_s < 1e-6 and back[1] > 0.0
    assert np.linalg.norm(back) <= 0.020 + 1e-3
    (tripped,), (held,) = bench.events("backing off"), bench.events("holding")
    assert tripped.measured == force_n and f"{force_n:.0f} N" in said(tripped)
    assert f"{force_n:.0f} N" in said(held)


def test_a_force_that_stays_ends_the_backing_off_all_the_same():
    bench, plant = feeling()
    plant.force_n = np.array([0.0, 500.0])
    bench.run(2 * DT_S)
    assert until(bench, ControlMode.HOLD) <= 2.0


def test_an_execution_in_contact_at_its_end_is_seated():
    bench, plant = feeling()
    plant.force_n = np.array([0.0, TASK.limits.contact_n - 0.1])
    while not bench.robot.phase.at_end:
        bench.run(DT_S)
    assert bench.robot.phase is Phase.ARRIVED
    plant.force_n = np.array([0.0, TASK.limits.contact_n])
    bench.run(DT_S)
    assert bench.robot.phase is Phase.SEATED and bench.mode is ControlMode.AUTONOMOUS
    assert bench.command(Action.CLUTCH).accepted and bench.mode is ControlMode.HOLD


# Sight ------------------------------------------------------------------------------------------


def test_without_sight_it_goes_on_for_three_tenths_of_a_second_and_then_slows_to_a_stop():
    bench = Bench(plant=(plant := FeelingPlant())).executing()
    bench.run(0.3)
    bench.sight.seen = False
    plant.told.clear()
    bench.run(0.3)
    assert set(plant.told) == {"accelerate"} and bench.speed_m_s > 0.05
    plant.told.clear()
    bench.run(0.4)
    assert set(plant.told) == {"brake"} and bench.speed_m_s < 1e-6
    assert bench.mode is ControlMode.AUTONOMOUS


def frozen_target(amplitude_m: float = 0.0) -> Bench:
    """Executing towards a target that stands still: what it is off by is what the test says."""
    target = structs.replace(TASK.target, amplitude_m=(amplitude_m, 0.0), noise_std_m=0.0)
    return Bench(structs.replace(TASK, target=target)).executing()


def test_what_is_seen_again_near_where_it_was_expected_goes_on_and_arrives():
    bench = frozen_target()
    bench.sight.seen = False
    bench.run(4.9)
    bench.sight.seen, bench.sight.shift_m = True, np.array([0.015, 0.0])
    bench.sight.turn_rad = math.radians(2.0)
    bench.run(15.0)
    assert bench.mode is ControlMode.AUTONOMOUS and bench.robot.phase is Phase.ARRIVED


@pytest.mark.parametrize(
    ("blind_s", "shift_m", "turn_rad", "why"),
    [
        (5.1, 0.0, 0.0, "not seen for 5 s"),
        (1.0, 0.025, 0.0, "25 mm off"),
        (1.0, 0.0, math.radians(4.0), "turned by 4 degrees"),
    ],
)
def test_else_it_is_paused_with_the_reason_and_can_be_resumed(blind_s, shift_m, turn_rad, why):
    bench = frozen_target()
    bench.sight.seen = False
    bench.run(blind_s)
    bench.sight.seen, bench.sight.turn_rad = True, turn_rad
    bench.sight.shift_m = np.array([shift_m, 0.0])
    bench.run(2 * DT_S)
    assert bench.mode is ControlMode.PAUSED
    (event,) = bench.events("paused")
    assert said(event).startswith("perception lost") and why in said(event) and event.measured
    bench.run(30.0)
    assert bench.mode is ControlMode.PAUSED and bench.speed_m_s < 1e-6
    assert bench.command(Action.RESUME).accepted
    bench.run(15.0)
    assert bench.robot.phase is Phase.ARRIVED


# The link ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("policy", "mode"),
    [
        ("continue", ControlMode.AUTONOMOUS),
        ("hold", ControlMode.PAUSED),
        ("retract", ControlMode.HOLD),
    ],
)
@pytest.mark.parametrize("delay_s", [0.05, 4.0])
def test_an_execution_follows_the_tasks_policy_when_the_link_is_lost(policy, mode, delay_s):
    bench = Bench(structs.replace(TASK, lost_link=policy), delay_s=delay_s).executing()
    bench.run(2.9, present=False)
    assert bench.mode is ControlMode.AUTONOMOUS and bench.robot.phase is not Phase.RETRACTING
    bench.run(0.3, present=False)
    where = bench.position_m
    bench.run(12.0, present=False)
    assert bench.mode is mode
    if policy == "continue":
        assert bench.robot.phase is Phase.ARRIVED
    elif policy == "retract":
        assert bench.position_m[1] > where[1] + 0.1
        assert said(bench.events("retracting")[0]).startswith("the link has been lost for 3.0 s")
        assert "retracting ended" in said(bench.events("holding")[0])
    else:
        assert said(bench.events("paused")[0]).startswith("the link has been lost for 3.0 s")
        bench.run(5.0)
        assert bench.mode is ControlMode.PAUSED  # the link came back: who resumes is the operator


@pytest.mark.parametrize("allowed", [False, True])
def test_blind_and_alone_for_a_minute_it_retracts_only_if_the_task_allows(allowed: bool):
    bench = Bench(structs.replace(TASK, blind_retract=allowed)).executing()
    bench.sight.seen = False
    bench.run(62.0, present=False)
    assert bench.mode is ControlMode.PAUSED
    bench.run(10.0, present=False)
    assert bench.mode is (ControlMode.HOLD if allowed else ControlMode.PAUSED)
    assert bool(bench.events("retracting")) == allowed


def test_blind_but_not_alone_it_waits_for_its_operator():
    bench = Bench(structs.replace(TASK, blind_retract=True)).executing()
    bench.sight.seen = False
    bench.run(120.0)
    assert bench.mode is ControlMode.PAUSED


# Faults -----------------------------------------------------------------------------------------


class Order(Bench):
    """Notes in one list what the plant is told, which mode is told, and what is written."""

    def __init__(self) -> None:
        super().__init__(plant=FeelingPlant())
        assert isinstance(self.plant, FeelingPlant)
        self.order: list[str] = self.plant.told

    def note(self) -> None:
        self.order.clear()
        announce, write = self.robot.events._announce, self.robot._black_box._write

        def announced(channel, message) -> None:
            if isinstance(message, Event):
                self.order.append(message.kind)
            announce(channel, message)

        def written(**fields) -> None:
            self.order.append(fields["kind"])
            write(**fields)

        self.robot.events._announce, self.robot._black_box._write = announced, written


@pytest.mark.parametrize("fault", ["a period that began late", "a force", "a position", "a target"])
def test_a_fault_brakes_first_then_stops_then_dumps_the_black_box(fault: str):
    bench = Order()
    bench.executing()
    plant = bench.plant
    assert isinstance(plant, FeelingPlant)
    bench.note()
    if fault == "a force":
        plant.force_n = np.array([np.nan, 0.0])
    elif fault == "a position":
        plant.push_to((np.nan, 0.5))
    elif fault == "a target":
        bench.sight.shift_m = np.array([np.nan, 0.0])
    bench.robot.tick(DT_S, late_s=0.6 if fault == "a period that began late" else 0.0)
    assert bench.mode is ControlMode.STOPPED
    assert bench.order[:3] == ["brake", "failed", "stopped"]
    assert len(bench.order) > 20 and set(bench.order[3:]) == {"black box"}
    bench.run(1.0)
    assert bench.order.count("stopped") == 1


def test_a_period_that_begins_late_matters_only_while_something_moves():
    bench = Bench().armed()
    bench.robot.tick(DT_S, late_s=2.0)
    assert bench.mode is ControlMode.HOLD


def test_a_missed_deadline_stops_with_how_late_it_was():
    bench = Bench().coupled()
    bench.robot.tick(DT_S, late_s=0.7)
    (event,) = bench.events("stopped")
    assert "700 ms late" in said(event) and event.measured == 0.7
