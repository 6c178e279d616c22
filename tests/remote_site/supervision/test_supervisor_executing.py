"""AUTONOMOUS: models, previews, and executions that need nobody."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.wire.messages import Event, PlannedPath
from farhand.common.wire.motion_encoding import points_of
from farhand.common.wire.reasons import Code, because
from farhand.remote_site.motion.preview_worker import plan
from tests.messages import said
from tests.remote_site.bench import DT_S, Bench
from tests.remote_site.planar import TASK, with_preview


def test_an_execution_arrives_by_itself_and_goes_on_tracking():
    bench = Bench().arrived()
    assert bench.mode is ControlMode.AUTONOMOUS
    errors = []
    for _ in range(250):
        bench.run(DT_S)
        errors.append(np.linalg.norm(bench.position_m - bench.robot.sensing.frames[0].b))
    assert np.sqrt(np.mean(np.square(errors))) < TASK.success_rms_m
    endings = [e for e in bench.heard(Event) if e.kind == "completed" and "arrived" in said(e)]
    assert len(endings) == 1


def test_an_execution_goes_on_when_the_link_is_lost():
    bench = Bench().executing()
    bench.run(10.0, present=False)
    assert bench.mode is ControlMode.AUTONOMOUS and bench.robot.phase is Phase.ARRIVED
    assert not bench.robot.contact.lease.lease_id


def test_abort_ends_an_execution_where_it_is_and_says_so():
    bench = Bench().executing()
    execution = bench.robot.motion.execution
    assert execution is not None
    bench.run(0.5)
    reply = bench.command(Action.ABORT)
    assert reply.accepted and bench.mode is ControlMode.HOLD
    bench.run(1.0)
    assert bench.speed_m_s < 1e-6
    executed, aborted = bench.ending(execution.command.command_id), bench.ending(reply.command_id)
    assert executed is not None and executed.kind == "failed" and not executed.succeeded
    assert aborted is not None and aborted.kind == "completed"


def test_execute_needs_a_model_that_was_received_and_this_task():
    bench = Bench().armed()
    assert "send it first" in said(bench.command(Action.EXECUTE, model_sha256="0" * 64))
    assert "send it first" in said(bench.command(Action.EXECUTE))
    sha256 = bench.send_model().sha256
    assert "planar" in said(bench.command(Action.EXECUTE, model_sha256=sha256, task="other"))
    assert bench.mode is ControlMode.HOLD


def test_execute_from_direct_decouples_first():
    bench = Bench().coupled()
    bench.drive(0.2, 0.0)
    assert bench.command(Action.EXECUTE, model_sha256=bench.send_model().sha256).accepted
    assert bench.mode is ControlMode.AUTONOMOUS and bench.robot.motion.coupling is None


def test_a_model_that_arrives_during_a_run_waits_for_the_next_execute():
    bench = Bench().executing()
    execution = bench.robot.motion.execution
    bench.send_model()
    assert bench.robot.motion.execution is execution
    assert bench.mode is ControlMode.AUTONOMOUS


def test_a_previewed_task_is_executed_by_its_plan_alone():
    bench = Bench(with_preview()).armed()
    sha256 = bench.send_model().sha256
    assert "preview" in said(bench.command(Action.EXECUTE, model_sha256=sha256))
    plan_id = bench.preview(sha256)
    assert plan_id
    assert "preview" in said(bench.command(Action.EXECUTE, model_sha256=sha256, plan_id=plan_id + 1))
    assert bench.mode is ControlMode.HOLD
    assert bench.command(Action.EXECUTE, model_sha256=sha256, plan_id=plan_id).accepted
    assert bench.mode is ControlMode.AUTONOMOUS


def test_a_preview_before_the_robot_moved_no_longer_counts():
    bench = Bench(with_preview()).armed()
    sha256 = bench.send_model().sha256
    plan_id = bench.preview(sha256)
    bench.command(Action.COUPLE)
    bench.drive(0.1, 0.0)
    bench.drive(3.0, 0.05)
    bench.command(Action.CLUTCH)
    bench.run(0.5)
    refusal = bench.command(Action.EXECUTE, model_sha256=sha256, plan_id=plan_id)
    assert not refusal.accepted and refusal.measured == pytest.approx(0.05, abs=2e-3)


def test_a_previewed_task_is_not_executed_while_coupled():
    bench = Bench(with_preview()).armed()
    sha256 = bench.send_model().sha256
    plan_id = bench.preview(sha256)
    bench.command(Action.COUPLE)
    assert not bench.command(Action.EXECUTE, model_sha256=sha256, plan_id=plan_id).accepted
    assert bench.mode is ControlMode.DIRECT


def test_a_preview_moves_nothing_and_shows_the_whole_way():
    bench = Bench().armed()
    plan_id = bench.preview(bench.send_model().sha256)
    bench.run(0.5)
    np.testing.assert_array_equal(bench.position_m, TASK.start_m)
    (path,) = bench.heard(PlannedPath)
    assert path.plan_id == plan_id and path.reaches_end
    points = points_of(path)
    assert np.linalg.norm(points[-1]) < 0.02
    assert [e.plan_id for e in bench.heard(Event) if e.kind == "completed"][-1] == plan_id


def test_a_preview_that_cannot_be_made_is_said_and_cannot_be_executed():
    bench = Bench(with_preview()).armed()
    sha256 = bench.send_model().sha256
    reply = bench.command(Action.PREVIEW, model_sha256=sha256)
    request = bench.plan_requests[-1]
    bench.robot.on_path(request, None, because(Code.PLAN_FAILED, text="reason"))
    ending = bench.ending(reply.command_id)
    assert ending is not None and not ending.succeeded and "reason" in said(ending)
    refusal = bench.command(Action.EXECUTE, model_sha256=sha256, plan_id=request.plan_id)
    assert not refusal.accepted


def test_a_newer_preview_replaces_the_one_under_way():
    bench = Bench().armed()
    sha256 = bench.send_model().sha256
    first = bench.command(Action.PREVIEW, model_sha256=sha256)
    overtaken = bench.plan_requests[-1]
    bench.preview(sha256)
    ending = bench.ending(first.command_id)
    assert ending is not None and ending.kind == "failed"
    n_said = len(bench.said)
    bench.robot.on_path(overtaken, plan(overtaken), None)
    assert len(bench.said) == n_said


def test_an_execution_has_its_path_planned_and_names_it():
    bench = Bench().executing()
    request = bench.plan_requests[-1]
    assert request.plan_id == 0 and bench.robot.path_id == 0
    path = PlannedPath(
        path_id=request.path_id, stamp=request.stamp, model_sha256=request.stored.sha256,
        n_coordinates=2, step_s=0.1, points=bytes(16), reaches_end=True,
    )  # fmt: skip
    bench.robot.on_path(request, path, None)
    assert bench.robot.path_id == request.path_id
    bench.command(Action.ABORT)
    assert bench.robot.path_id == 0
