"""Pause, resume, retract, go to ready, and models that arrive meanwhile."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.remote_site.robots.plant_memory import PlantState
from tests.remote_site.bench import DT_S, Bench, FeelingPlant
from tests.remote_site.planar import TASK, transfer
from tests.strategies import learned


def test_a_paused_robot_stands_and_keeps_its_execution():
    bench = Bench().executing()
    execution = bench.robot.motion.execution
    bench.run(0.3)
    reply = bench.command(Action.PAUSE)
    assert reply.accepted and reply.mode is ControlMode.PAUSED
    bench.run(0.5)
    stands = bench.position_m
    ending = bench.ending(reply.command_id)
    assert ending is not None and ending.kind == "completed"
    bench.run(60.0)
    np.testing.assert_array_equal(bench.position_m, stands)
    assert bench.robot.motion.execution is execution


@pytest.mark.parametrize("pushed_to", [(0.3, 0.4), (0.6, 0.9), (0.1, 0.1)])
def test_a_robot_that_was_pushed_while_paused_finds_its_way_and_arrives(pushed_to: tuple[float, float]):
    plant = FeelingPlant()
    bench = Bench(plant=plant).executing()
    bench.command(Action.PAUSE)
    bench.run(1.0)
    plant.push_to(pushed_to)
    bench.run(1.0)
    assert bench.command(Action.RESUME).accepted
    before = bench.position_m
    bench.run(DT_S)
    assert np.linalg.norm(bench.position_m - before) <= TASK.limits.speed_m_s * DT_S
    bench.run(15.0)
    assert bench.robot.phase is Phase.ARRIVED
    assert np.linalg.norm(bench.position_m - bench.robot.sensing.frames[0].b) < 0.02


def test_a_paused_execution_can_be_aborted_and_says_so():
    bench = Bench().paused()
    execution = bench.robot.motion.execution
    assert execution is not None
    assert bench.command(Action.ABORT).accepted and bench.mode is ControlMode.HOLD
    ending = bench.ending(execution.command.command_id)
    assert ending is not None and ending.kind == "failed"
    assert not bench.command(Action.RESUME).accepted


@pytest.mark.parametrize("action", [Action.RETRACT, Action.GO_TO_READY])
@pytest.mark.parametrize("beginning", [Bench.armed, Bench.paused, Bench.arrived])
def test_retract_and_go_to_ready_end_in_hold_and_are_answered_twice(action: Action, beginning):
    bench = beginning(Bench())
    reply = bench.command(action)
    assert reply.accepted and reply.mode is ControlMode.AUTONOMOUS
    assert bench.robot.phase in (Phase.RETRACTING, Phase.GOING_TO_READY)
    bench.run(10.0)
    assert bench.mode is ControlMode.HOLD and bench.speed_m_s < 1e-6
    ending = bench.ending(reply.command_id)
    assert ending is not None and ending.kind == "completed"


def test_a_manoeuvre_can_be_paused_and_goes_on_to_its_end():
    bench = Bench().arrived()
    reply = bench.command(Action.GO_TO_READY)
    bench.run(0.5)
    assert bench.command(Action.PAUSE).accepted
    bench.run(30.0)
    assert bench.mode is ControlMode.PAUSED
    assert bench.command(Action.RESUME).accepted and bench.robot.phase is Phase.GOING_TO_READY
    bench.run(10.0)
    ending = bench.ending(reply.command_id)
    assert ending is not None and ending.kind == "completed"
    np.testing.assert_allclose(bench.position_m, TASK.start_m, atol=2e-3)


def test_a_model_that_arrives_during_a_run_is_active_at_the_next_execute_and_no_sooner():
    bench = Bench().executing()
    first = transfer().sha256
    newer = transfer(learned(seed=3))
    assert bench.send_model(newer).accepted
    execution = bench.robot.motion.execution
    assert execution is not None and execution.stored.sha256 == first
    bench.command(Action.PAUSE)
    bench.command(Action.RESUME)
    bench.run(0.5)
    assert bench.robot.motion.execution is execution and execution.stored.sha256 == first
    bench.command(Action.ABORT)
    assert bench.command(Action.EXECUTE, model_sha256=newer.sha256).accepted
    execution = bench.robot.motion.execution
    assert execution is not None and execution.stored.sha256 == newer.sha256


@pytest.mark.parametrize("beginning", [Bench.executing, Bench.paused])
def test_a_restart_in_the_middle_of_an_execution_is_remembered(beginning):
    bench = beginning(Bench())
    state = PlantState.of(bench.robot.sensing, bench.robot.motion)
    assert state.executing == transfer().sha256
    bench.command(Action.ABORT)
    bench.run(0.5)
    assert PlantState.of(bench.robot.sensing, bench.robot.motion).executing == ""
