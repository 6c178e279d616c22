"""What the paper leaves open, solved: how a motion is carried out when something is out of the ordinary."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings
from farhand.remote_site.reproduction.point_rollout import roll_out
from tests.remote_site.reproduction.scenes import DT, STARTS, descent, descents, run, still

Array = NDArray[np.float64]


def learned_from(paths: list[Array], lambda_m: float, dt: float | list[float] = DT) -> TPHSMM:
    learner = OnlineLearner(LearnerSettings(lambda_m, min_std_m=0.005), 2, ["goal"])
    periods = dt if isinstance(dt, list) else [dt] * len(paths)
    for path, period in zip(paths, periods, strict=True):
        learner.start()
        times = (period * np.arange(float(len(path)))).tolist()
        learner.observe_many(path, [TaskFrame.identity(2)], times)
        learner.end()
    return learner.model()


def rolled(model: TPHSMM, start: Array) -> Array:
    result = roll_out(model, start, lambda t: still())
    assert result.arrived
    return result.points


def furthest_from(path: Array, other: Array) -> float:
    """Largest distance of a point of one path from the other path [m]."""
    return float(np.linalg.norm(path[:, None] - other, axis=2).min(axis=1).max())


def test_a_robot_that_waits_at_a_component_s_exit_goes_on_and_never_circles():
    """A way that bends sharply: leaving a component is far off the line between the means."""
    corner = np.concatenate(
        [np.linspace([0.6, 0.0], [0.0, 0.0], 150), np.linspace([0.0, 0.0], [0.0, -0.6], 150)]
    )
    model = learned_from([corner], 0.25)
    for start in ([0.6, 0.0], [0.7, 0.1], [0.3, 0.2]):
        result = roll_out(model, np.array(start), lambda t: still())
        assert result.arrived
        assert result.time_s[-1] < 10.0
        changes = np.count_nonzero(np.diff(result.components))
        assert changes <= model.n_components


@pytest.mark.parametrize("angle", np.linspace(0.0, 2.0 * np.pi, 6, endpoint=False))
def test_a_push_off_the_final_approach_comes_in_again_as_demonstrated(angle: float):
    model = descents()
    by = 0.12 * np.array([np.cos(angle), abs(np.sin(angle))])  # it stays in front of the goal
    pushed = [False]

    def disturb(t: float, p: Array) -> Array:
        if not pushed[0] and np.linalg.norm(p) < 0.05:
            pushed[0] = True
            return p + by
        return p

    executed = run(Executor(model, ExecutorSettings()), np.array(STARTS[0]), lambda t: still(), 20.0, disturb)
    assert executed.arrived_s is not None
    path = executed.positions
    last = path[np.flatnonzero(np.linalg.norm(path, axis=1) > 0.04)[-1] :]
    assert np.abs(last[:, 0]).max() < 0.012  # from above, as all demonstrations


def test_a_start_beside_the_goal_first_goes_to_where_the_approach_begins():
    path = rolled(descents(), np.array([0.12, 0.03]))
    assert path[:, 1].max() > 0.1
    last = path[np.flatnonzero(np.linalg.norm(path, axis=1) > 0.04)[-1] :]
    assert np.abs(last[:, 0]).max() < 0.012


def test_a_start_behind_the_goal_is_refused_with_a_reason():
    executor = Executor(descents(), ExecutorSettings())
    with pytest.raises(InvalidInput, match="behind the end of the motion"):
        executor.begin(np.array([0.01, -0.08]), np.zeros(2), still())
    executor.begin(np.array([0.01, 0.08]), np.zeros(2), still())


def test_a_path_that_crosses_itself_is_followed_through_the_crossing():
    s = np.linspace(0.0, 2.0 * np.pi, 400)
    eight = np.stack([0.4 * np.sin(s + 0.4), 0.3 * np.sin(2.0 * (s + 0.4))], axis=1)
    path = rolled(learned_from([eight, eight + 0.004], 0.15), eight[0])
    assert furthest_from(eight, path) < 0.06
    assert furthest_from(path, eight) < 0.06


def test_a_path_that_returns_on_itself_goes_out_and_comes_back():
    out = np.linspace([0.0, 0.0], [0.6, 0.0], 150)
    there_and_back = np.concatenate([out, out[::-1]])
    path = rolled(learned_from([there_and_back], 0.15), np.zeros(2))
    assert path[:, 0].max() > 0.5
    assert abs(path[-1, 0]) < 0.01


def test_demonstrations_of_another_rate_teach_the_same():
    paths = [descent(start, 400) for start in STARTS]
    fine = learned_from(paths, 0.15, 0.01)
    coarse = learned_from([path[::4] for path in paths], 0.15, 0.04)
    assert abs(fine.n_components - coarse.n_components) <= 1
    start = np.array(STARTS[0])
    a, b = (roll_out(m, start, lambda t: still()) for m in (fine, coarse))
    assert furthest_from(a.points, b.points) < 0.02
    assert a.time_s[-1] == pytest.approx(b.time_s[-1], rel=0.1)


def test_demonstrations_of_another_speed_are_carried_out_at_theirs():
    paths = [descent(start) for start in STARTS]
    quick, slow = learned_from(paths, 0.15, 0.02), learned_from(paths, 0.15, 0.05)
    start = np.array(STARTS[1])
    a, b = (roll_out(m, start, lambda t: still()) for m in (quick, slow))
    assert b.time_s[-1] / a.time_s[-1] == pytest.approx(2.5, rel=0.15)
    assert furthest_from(a.points, b.points) < 0.03


def test_demonstrations_of_mixed_speed_and_length_teach_one_task():
    paths = [descent(STARTS[0], 100), descent(STARTS[1], 400), descent(STARTS[2], 250)[60:]]
    model = learned_from(paths, 0.15)
    for start in STARTS[:2]:
        assert np.linalg.norm(rolled(model, np.array(start))[-1]) < 0.005


def test_the_loop_is_as_fast_as_short_components_need():
    """At a fixed 5 rad/s the fast one would cut the bends by 8 cm."""
    angle = np.linspace(0.0, 2.0 * np.pi, 300)
    wave = np.stack([0.8 - 0.8 * angle / (2.0 * np.pi), 0.1 * np.sin(2.0 * angle)], axis=1)
    for dt in (0.02, 0.01):
        assert furthest_from(wave, rolled(learned_from([wave], 0.1, dt), wave[0])) < 0.015


def test_a_pause_in_a_demonstration_neither_splits_nor_stalls():
    path = descent(STARTS[0])
    paused = np.concatenate([path[:90], np.repeat(path[90:91], 150, axis=0), path[90:]])
    plain, with_pause = learned_from([path], 0.15), learned_from([paused], 0.15)
    assert abs(plain.n_components - with_pause.n_components) <= 1
    assert np.linalg.norm(rolled(with_pause, path[0])[-1]) < 0.005


def test_the_order_of_the_demonstrations_hardly_matters():
    paths = [descent(start) for start in STARTS]
    forwards, backwards = learned_from(paths, 0.15), learned_from(paths[::-1], 0.15)
    for start in STARTS:
        a, b = (rolled(m, np.array(start)) for m in (forwards, backwards))
        assert furthest_from(a, b) < 0.04
        assert furthest_from(b, a) < 0.04


def test_an_old_model_is_refined_by_what_is_shown_later():
    learner = OnlineLearner(LearnerSettings(0.15, min_std_m=0.005), 2, ["goal"])
    models = []
    for start in STARTS:
        learner.start()
        path = descent(start)
        learner.observe_many(path, [TaskFrame.identity(2)], (DT * np.arange(float(len(path)))).tolist())
        learner.end()
        models.append(learner.model())
    assert [m.n_demonstrations for m in models] == [1, 2, 3]
    new = descent(STARTS[2])
    errors = [furthest_from(new, rolled(m, new[0])) for m in models]
    assert errors[2] < 0.5 * errors[0]
    old = descent(STARTS[0])
    assert (
        furthest_from(old, rolled(models[2], old[0])) < furthest_from(old, rolled(models[0], old[0])) + 0.02
    )


def test_a_far_start_joins_the_learned_way_instead_of_moving_it():
    model = descents()
    near = rolled(model, np.add(STARTS[2], (0.15, 0.1)))
    last = near[np.flatnonzero(np.linalg.norm(near, axis=1) > 0.1)[-1] :]
    assert np.abs(last[:, 0]).max() < 0.03
