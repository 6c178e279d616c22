from __future__ import annotations

import queue
import threading
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import PlannedPath
from farhand.common.wire.motion_encoding import points_of
from farhand.common.wire.reason_words import sentence
from farhand.common.wire.reasons import Reason
from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.motion.model_trial import StoredModel
from farhand.remote_site.motion.preview_worker import MAX_POINTS, STEP_S, PlanRequest, PreviewWorker, plan
from farhand.remote_site.reproduction.executor import ExecutorSettings
from tests.remote_site.bench import Bench
from tests.remote_site.planar import TASK

PATIENCE_S = 60.0
Delivered = tuple[PlanRequest, PlannedPath | None, str]


def a_request(plan_id: int = 1) -> PlanRequest:
    bench = Bench().armed()
    bench.preview(bench.send_model().sha256)
    return replace(bench.plan_requests[-1], plan_id=plan_id)


def test_a_plan_leads_from_where_the_robot_is_to_the_end_in_the_frame():
    request = a_request()
    path = plan(request)
    points = points_of(path)
    np.testing.assert_allclose(points[0], TASK.start_m - request.frames[0].b, atol=1e-6)
    assert np.linalg.norm(points[-1]) < 0.02
    assert path.step_s == STEP_S and path.reaches_end and len(points) <= MAX_POINTS
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert steps.max() <= TASK.limits.speed_m_s * STEP_S + 1e-6
    assert (path.plan_id, path.stamp) == (request.plan_id, request.stamp)
    assert path.model_sha256 == request.stored.sha256


def test_a_plan_in_the_middle_of_an_execution_is_the_rest_of_it():
    bench = Bench().executing()
    whole = plan(bench.plan_requests[-1])
    bench.run(1.6)
    rest = plan(bench.plan_requests[-1])
    assert rest.reaches_end
    assert len(points_of(rest)) < len(points_of(whole)) - 5


def test_planning_changes_nothing_of_the_execution():
    bench, undisturbed = Bench().executing(), Bench().executing()
    for _ in range(3):
        plan(bench.plan_requests[-1])
        bench.run(0.5)
        undisturbed.run(0.5)
    np.testing.assert_array_equal(bench.position_m, undisturbed.position_m)


@pytest.fixture
def worker() -> Iterator[tuple[PreviewWorker, queue.SimpleQueue[Delivered]]]:
    delivered: queue.SimpleQueue[Delivered] = queue.SimpleQueue()
    planner = PreviewWorker(lambda *result: delivered.put(result))
    yield planner, delivered
    planner.close()


def test_the_worker_delivers_what_was_asked_from_another_thread(worker):
    planner, delivered = worker
    request = a_request()
    planner.request(request)
    done, path, problem = delivered.get(timeout=PATIENCE_S)
    assert done is request and path == plan(request) and problem is None


def test_a_plan_that_fails_is_said_and_the_worker_goes_on(worker):
    planner, delivered = worker
    good = a_request()
    bad = replace(good, frames=(TaskFrame(np.eye(3), np.zeros(3)),))
    planner.request(bad)
    done, path, problem = delivered.get(timeout=PATIENCE_S)
    assert done is bad and path is None and "the plan failed" in sentence(problem)
    planner.request(good)
    assert delivered.get(timeout=PATIENCE_S)[1] is not None


def test_of_what_waits_only_the_newest_preview_and_commit_are_planned():
    held, begun = threading.Event(), threading.Event()
    delivered: list[int] = []
    all_done = threading.Event()

    def deliver(request: PlanRequest, _path: PlannedPath | None, _note: Reason | None) -> None:
        delivered.append(request.path_id)
        begun.set()
        held.wait(PATIENCE_S)
        if len(delivered) == 3:
            all_done.set()

    planner, request = PreviewWorker(deliver), a_request()
    planner.request(replace(request, path_id=1))
    assert begun.wait(PATIENCE_S)
    for path_id in range(2, 8):
        planner.request(replace(request, path_id=path_id, plan_id=path_id % 2))
    held.set()
    assert all_done.wait(PATIENCE_S)
    planner.close()
    assert sorted(delivered) == [1, 6, 7]


def test_a_plan_is_cut_where_it_has_too_many_points():
    request = a_request()
    slow = ExecutorSettings(max_speed_m_s=0.005)
    stored = StoredModel(request.stored.sha256, request.stored.model, TASK)
    at_rest = EffectorState(np.array(TASK.start_m), np.zeros(2))
    path = plan(replace(request, settings=slow, stored=stored, effector=at_rest))
    assert not path.reaches_end and len(points_of(path)) == MAX_POINTS
