"""The pace of what the robot does by itself, on the whole supervisor in virtual time."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.errors import InvalidMessage
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import Command, PlannedPath
from farhand.remote_site.motion.preview_worker import plan
from farhand.remote_site.telemetry import Reporter
from tests.messages import said
from tests.remote_site.bench import DT_S, Bench, FeelingPlant, in_mode
from tests.remote_site.planar import TASK


def pace_reported(bench: Bench) -> float:
    return Reporter(bench.robot, bench.clock).report().pace


def time_to_arrive(bench: Bench, at_most_s: float = 120.0) -> float:
    """How long the execution under way takes until it has arrived [s]."""
    for tick in range(round(at_most_s / DT_S)):
        if bench.robot.phase is Phase.ARRIVED:
            return tick * DT_S
        bench.run(DT_S)
    raise AssertionError("it never arrived")


@pytest.mark.parametrize("mode", ControlMode)
def test_the_pace_is_set_in_every_mode_and_changes_no_mode(mode: ControlMode):
    bench = in_mode(mode)
    bench.ask_lease()
    reply = bench.command(Action.SET_PACE, pace=0.5)
    assert reply.accepted and reply.mode is mode
    ending = bench.ending(reply.command_id)
    assert ending is not None and ending.succeeded and "50%" in said(ending)
    assert bench.mode is mode and pace_reported(bench) == 0.5


def test_who_does_not_hold_the_lease_sets_no_pace():
    bench = Bench().armed()
    assert not bench.command(Action.SET_PACE, pace=0.5, lease_id="made up").accepted
    assert pace_reported(bench) == 1.0


@pytest.mark.parametrize("pace", [0.0, 0.09, 1.01, -0.5])
def test_a_pace_out_of_bounds_is_no_command(pace: float):
    command = Command(
        command_id="a", session="b", lease_id="c", action=Action.SET_PACE, echo=None, pace=pace
    )  # fmt: skip
    with pytest.raises(InvalidMessage, match="pace"):
        decode(encode(command), Command)


@pytest.mark.parametrize("when", ["before", "under way"])
def test_at_half_the_pace_an_execution_takes_about_twice_as_long_and_follows_the_target_as_closely(when: str):
    usual, slow = Bench(), Bench()
    usual_s = time_to_arrive(usual.executing())
    if when == "before":
        slow.ask_lease()
        slow.command(Action.SET_PACE, pace=0.5)
        slow.executing()
    else:
        slow.executing().command(Action.SET_PACE, pace=0.5)
    slow_s = time_to_arrive(slow)
    assert 1.7 < slow_s / usual_s < 2.5
    errors = []
    for _ in range(250):
        slow.run(DT_S)
        errors.append(np.linalg.norm(slow.position_m - slow.robot.sensing.frames[0].b))
    assert np.sqrt(np.mean(np.square(errors))) < TASK.success_rms_m


def test_a_preview_and_a_committed_path_are_as_slow_as_the_execution():
    bench = Bench().armed()
    sha256 = bench.send_model().sha256

    def points_of_preview() -> int:
        bench.command(Action.PREVIEW, model_sha256=sha256)
        path = plan(bench.plan_requests[-1])
        return len(path.points)

    usual = points_of_preview()
    bench.command(Action.SET_PACE, pace=0.5)
    assert 1.6 < points_of_preview() / usual < 2.5


def test_a_change_on_the_way_is_committed_anew_at_once():
    bench = Bench().executing()
    bench.run(1.5)
    n = len(bench.plan_requests)
    bench.command(Action.SET_PACE, pace=0.3)
    bench.run(2 * DT_S)
    assert len(bench.plan_requests) > n
    assert bench.plan_requests[-1].settings.pace == 0.3
    assert isinstance(plan(bench.plan_requests[-1]), PlannedPath)


def test_a_manoeuvre_that_the_operator_asked_for_is_paced_also_on_the_way():
    bench = Bench().armed()
    bench.command(Action.SET_PACE, pace=0.1)
    bench.command(Action.RETRACT)
    bench.run(1.0)
    usual_m_s = 0.5 * TASK.limits.speed_m_s
    assert 0.0 < bench.speed_m_s <= 0.1 * usual_m_s + 1e-9
    bench.command(Action.SET_PACE, pace=1.0)
    bench.run(0.2)
    assert bench.speed_m_s > 0.2 * usual_m_s


def test_what_the_robot_does_for_safety_is_not_paced():
    plant = FeelingPlant(TASK)
    bench = Bench(plant=plant).coupled()
    bench.command(Action.SET_PACE, pace=0.1)
    plant.force_n = np.array([0.0, 450.0])
    speeds = []
    while bench.mode is not ControlMode.HOLD:
        bench.run(DT_S)
        if bench.robot.phase is Phase.BACKING_OFF:
            bench.command(Action.SET_PACE, pace=0.1)
            speeds.append(bench.speed_m_s)
    assert max(speeds) > 0.2 * 0.5 * TASK.limits.speed_m_s


def test_driving_is_not_paced():
    def driven_m(pace: float) -> float:
        bench = Bench().coupled()
        bench.command(Action.SET_PACE, pace=pace)
        bench.drive(0.2, 0.0)
        bench.drive(2.0, 0.1)
        return float(bench.position_m[0] - TASK.start_m[0])

    assert driven_m(0.1) == driven_m(1.0) > 0.05
