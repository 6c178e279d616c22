"""A preview counts as long as what it showed is still what would happen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from farhand.common.mode_table import Action
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import Stamp
from farhand.common.wire.reason_words import sentence
from farhand.remote_site.motion.plans import Plans, PreviewConditions
from tests.remote_site.bench import Bench

SHA = "a" * 64


def previewed() -> tuple[Bench, int, PreviewConditions]:
    """A robot with a plan that was shown, its id, and the situation that it was made in."""
    bench = Bench().armed()
    sha256 = bench.send_model().sha256
    plan_id = bench.preview(sha256)
    return bench, plan_id, plans_of(bench).situation(sha256, bench.robot.stamp())


def plans_of(bench: Bench) -> Plans:
    return bench.robot._plans


def shifted(frame: TaskFrame, x_m: float, y_m: float) -> TaskFrame:
    return TaskFrame(frame.A, frame.b + np.array([x_m, y_m]))


def turned(frame: TaskFrame, degrees: float) -> TaskFrame:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return TaskFrame(frame.A @ np.array([[c, -s], [s, c]]), frame.b)


def moved_frame(now: PreviewConditions, to: Callable[[TaskFrame], TaskFrame]) -> PreviewConditions:
    return replace(now, mean_frames=[*map(to, now.mean_frames)])


def moved_effector(now: PreviewConditions, to: Callable[[TaskFrame], TaskFrame]) -> PreviewConditions:
    return replace(now, effector=to(now.effector))


@pytest.mark.parametrize(("move", "degrees"), [(moved_effector, 3.0), (moved_frame, 5.0)])
def test_it_is_refused_once_robot_or_target_turned_too_far(
    move: Callable[..., PreviewConditions], degrees: float
):
    bench, plan_id, now = previewed()
    little, much = (move(now, lambda frame, d=d: turned(frame, degrees + d)) for d in (-0.1, 0.1))
    assert plans_of(bench).refusal(plan_id, little, 0.0) is None
    reason = plans_of(bench).refusal(plan_id, much, 0.0)
    assert (
        reason is not None
        and "turned" in sentence(reason)
        and reason.measured == pytest.approx(np.radians(degrees + 0.1))
    )


def test_a_plan_holds_while_nothing_changed():
    bench, plan_id, now = previewed()
    assert plans_of(bench).refusal(plan_id, now, 0.0) is None


@pytest.mark.parametrize("distance_m", [0.0, 0.009, 0.011, 0.2])
def test_it_is_refused_with_the_measured_difference_once_the_robot_moved_a_centimetre(distance_m: float):
    bench, plan_id, now = previewed()
    moved = replace(now, effector=shifted(now.effector, 0.0, distance_m))
    reason = plans_of(bench).refusal(plan_id, moved, 0.0)
    if distance_m <= 0.010:
        assert reason is None
    else:
        assert (
            reason is not None
            and "the robot moved" in sentence(reason)
            and reason.measured == pytest.approx(distance_m)
        )


@pytest.mark.parametrize("distance_m", [0.0, 0.049, 0.051, 0.3])
def test_and_once_the_target_moved_five_centimetres_in_the_mean(distance_m: float):
    bench, plan_id, now = previewed()
    moved = moved_frame(now, lambda frame: shifted(frame, distance_m, 0.0))
    reason = plans_of(bench).refusal(plan_id, moved, 0.0)
    if distance_m <= 0.050:
        assert reason is None
    else:
        assert (
            reason is not None
            and "the target moved" in sentence(reason)
            and reason.measured == pytest.approx(distance_m)
        )


def test_it_is_refused_for_another_model_and_for_another_number():
    bench, plan_id, now = previewed()
    plans = plans_of(bench)
    assert "model" in sentence(plans.refusal(plan_id, replace(now, model_sha256=SHA), 0.0))
    assert "no plan" in sentence(plans.refusal(plan_id + 1, now, 0.0))
    assert "no plan" in sentence(plans.refusal(0, now, 0.0))


@pytest.mark.parametrize("round_trip_s", [0.0, 4.0])
def test_it_is_refused_after_a_minute_and_the_round_trip(round_trip_s: float):
    bench, plan_id, now = previewed()
    plans = plans_of(bench)
    young = replace(now, time_s=now.time_s + 59.9 + round_trip_s)
    old = replace(now, time_s=now.time_s + 60.1 + round_trip_s)
    assert plans.refusal(plan_id, young, round_trip_s) is None
    reason = plans.refusal(plan_id, old, round_trip_s)
    assert (
        reason is not None
        and "old" in sentence(reason)
        and reason.measured == pytest.approx(60.1 + round_trip_s)
    )


def test_a_plan_that_the_operator_has_not_seen_does_not_count():
    bench = Bench().armed()
    sha256 = bench.send_model().sha256
    bench.command(Action.PREVIEW, model_sha256=sha256)
    request = bench.plan_requests[-1]
    now = plans_of(bench).situation(sha256, bench.robot.stamp())
    assert plans_of(bench).refusal(request.plan_id, now, 0.0) is not None


def test_only_the_last_previews_are_kept():
    bench, first, now = previewed()
    plans, request = plans_of(bench), bench.plan_requests[-1]
    stored = request.stored
    for _ in range(50):
        plans.preview(stored, Stamp("boot", bench.time.ns))
        plans.shown(bench.plan_requests[-1])
    assert "no plan" in sentence(plans.refusal(first, now, 0.0))
    assert plans.refusal(bench.plan_requests[-1].plan_id, now, 0.0) is None


def test_an_execution_is_planned_at_once_then_once_a_second_at_most():
    bench = Bench().executing()
    asked = [request for request in bench.plan_requests if not request.plan_id]
    assert len(asked) == 1 and asked[0].state is not None
    bench.run(5.0)
    stamps = [request.stamp.t_ns for request in bench.plan_requests]
    assert len(stamps) >= 3
    assert np.diff(stamps).min() >= 1e9 and np.diff(stamps).max() < 1.1e9
    assert len({request.path_id for request in bench.plan_requests}) == len(stamps)
