from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from farhand.common.errors import InvalidConfiguration, InvalidInput, InvalidModel
from farhand.common.model.manifold import POSE
from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings
from farhand.remote_site.reproduction.warm_up import warm_up
from tests.remote_site.reproduction.scenes import DT, STARTS, descent, descents, run, still
from tests.strategies import learned

MODEL = descents()
SETTINGS = ExecutorSettings()


@settings(deadline=None, derandomize=True, max_examples=8)
@given(start=st.sampled_from(STARTS), x=st.floats(-2, 2), y=st.floats(-2, 2), angle=st.floats(-3, 3))
def test_the_motion_is_reproduced_wherever_the_frame_is(
    start: tuple[float, float], x: float, y: float, angle: float
):
    frames = still(np.array([x, y]), angle)
    result = run(Executor(MODEL, SETTINGS), frames[0].to_world(np.array(start)), lambda t: frames, 9.0)
    local = frames[0].to_local(result.positions)
    assert np.linalg.norm(local[-1]) < 0.003
    assert result.arrived_s is not None
    assert 3.0 < result.arrived_s < 6.0
    taught = descent(start)
    nearest = np.linalg.norm(local[:, None] - taught, axis=2).min(axis=1)
    assert nearest.max() < 0.05


@pytest.mark.parametrize("pace", [0.1, 0.5])
def test_a_slower_pace_is_slower_all_the_way_and_ends_in_the_same_place(pace: float):
    limit_m_s = 0.4
    slowed = replace(SETTINGS, max_speed_m_s=limit_m_s, pace=pace)
    usual = run(Executor(MODEL, replace(slowed, pace=1.0)), np.array(STARTS[0]), lambda t: still(), 12.0)
    slow = run(Executor(MODEL, slowed), np.array(STARTS[0]), lambda t: still(), 12.0 / pace)
    assert usual.arrived_s is not None and slow.arrived_s is not None
    assert 0.8 / pace < slow.arrived_s / usual.arrived_s < 1.3 / pace
    assert np.linalg.norm(slow.positions[-1]) < 0.003
    speeds = np.linalg.norm(np.diff(slow.positions, axis=0), axis=1) / DT
    assert speeds.max() <= pace * limit_m_s * 1.001
    nearest = np.linalg.norm(slow.positions[:, None] - descent(STARTS[0]), axis=2).min(axis=1)
    assert nearest.max() < 0.05


@pytest.mark.parametrize("pace", [0.0, -0.5, 1.5, np.nan])
def test_a_pace_that_is_none_is_refused(pace: float):
    with pytest.raises(InvalidConfiguration, match="pace"):
        replace(SETTINGS, pace=pace)


@pytest.mark.parametrize("start", [(0.6, 0.6), (-1.2, -0.4), (0.3, 1.5)])
def test_a_far_start_first_reaches_the_model_and_then_follows_it_from_above(start: tuple[float, float]):
    result = run(Executor(MODEL, SETTINGS), np.array(start), lambda t: still(), 12.0)
    assert np.linalg.norm(result.positions[-1]) < 0.003
    last = result.positions[np.linalg.norm(result.positions, axis=1) > 0.03][-1]
    assert last[1] > abs(last[0])


def test_a_target_that_jumps_a_push_and_a_hold_are_overcome():
    elsewhere = still(np.array([0.15, 0.1]), 0.3)
    cases = {
        "jump": (lambda t: elsewhere if t > 2.0 else still(), None, elsewhere[0].b),
        "push": (
            lambda t: still(),
            lambda t, p: p + np.array([0.1, 0.06]) if abs(t - 2.0) < 1e-9 else p,
            np.zeros(2),
        ),
        "held": (lambda t: still(), lambda t, p: np.array([-0.5, 0.7]) if t < 3.0 else p, np.zeros(2)),
    }
    for name, (frames_at, disturb, goal) in cases.items():
        result = run(Executor(MODEL, SETTINGS), np.array([-0.5, 0.7]), frames_at, 14.0, disturb)
        assert np.linalg.norm(result.positions[-1] - goal) < 0.003, name
        assert result.arrived_s is not None, name


@pytest.mark.parametrize("period_s", [6.0, 4.0, 3.0])
def test_a_frame_that_oscillates_is_followed_to_less_than_one_per_cent_of_the_board(period_s: float):
    """Amplitude 10 % of a board of 1 m, frame seen at 50 Hz with a noise of 0.3 %, RMS over 10 s after arrival."""
    rng = np.random.default_rng(0)

    def truth(t: float) -> NDArray:
        return np.array([0.10 * np.sin(2 * np.pi * t / period_s), 0.0])

    def seen(t: float) -> list[TaskFrame]:
        return still(truth(t) + 0.003 * rng.normal(size=2))

    result = run(Executor(MODEL, SETTINGS), np.array([-0.6, 0.45]), seen, 20.0)
    assert result.arrived_s is not None
    assert result.arrived_s < 10.0
    first = round(result.arrived_s / DT)
    times = DT * np.arange(first + 1, first + 501)  # positions are those after each step
    errors = result.positions[first : first + 500] - np.array([truth(t) for t in times])
    assert np.sqrt((errors**2).sum(axis=1).mean()) < 0.01


def test_limits_are_kept():
    limits = replace(SETTINGS, max_acceleration_m_s2=0.8, max_speed_m_s=0.3)
    result = run(Executor(MODEL, limits), np.array([0.8, 0.8]), lambda t: still(), 15.0)
    assert np.linalg.norm(result.commands, axis=1).max() <= 0.8 + 1e-9
    speeds = np.linalg.norm(np.diff(result.positions, axis=0), axis=1) / DT
    assert speeds.max() <= 0.3 + 0.8 * DT
    assert np.linalg.norm(result.positions[-1]) < 0.005


def test_a_shorter_control_horizon_still_arrives():
    short = replace(SETTINGS, control_horizon_s=0.4)
    assert (short.n_steps, short.n_controls) == (60, 20)
    result = run(Executor(MODEL, short), np.array([-0.6, 0.45]), lambda t: still(), 9.0)
    assert np.linalg.norm(result.positions[-1]) < 0.005


@pytest.mark.parametrize(("n_dims", "n_frames"), [(2, 2), (3, 1), (3, 2)])
def test_other_dimensions_and_more_frames_work_the_same_way(n_dims: int, n_frames: int):
    model = learned(n_dims, n_frames)
    frames = [TaskFrame.identity(n_dims)] * n_frames
    start = model.start_means[0, int(np.argmax(model.initial))]
    result = run(Executor(model, SETTINGS), start, lambda t: frames, 12.0)
    assert result.arrived_s is not None
    assert np.linalg.norm(result.positions[-1]) < 0.01


def test_the_prediction_is_what_then_happens():
    executor, start, frames = (
        Executor(MODEL, SETTINGS),
        np.array([-0.6, 0.45]),
        still(np.array([0.2, 0.1]), 0.4),
    )
    executor.begin(start, np.zeros(2), frames)
    path = executor.predict(start, np.zeros(2), frames)
    result = run(executor, start, lambda t: frames, 9.0)
    assert path.done
    np.testing.assert_allclose(path.points_world[0], start)
    np.testing.assert_allclose(
        path.points_world[1:-1], result.positions[4 : 5 * (len(path.points_world) - 2) : 5]
    )
    np.testing.assert_allclose(frames[0].to_world(path.points_local), path.points_world)
    assert path.step_s == pytest.approx(0.1)
    assert (
        not executor.predict(start, np.zeros(2), frames, max_points=5).done
        or executor.state().progress.arrived
    )


def test_a_prediction_changes_nothing_and_a_copy_continues_alike():
    one, frames = Executor(MODEL, SETTINGS), still()
    p, v = np.array([-0.7, 0.2]), np.zeros(2)
    one.begin(p, v, frames)
    for _ in range(30):
        one.step(p, v, frames)
    state = one.state()
    one.predict(p, v, frames)
    assert one.state() is state
    other = Executor.from_state(MODEL, SETTINGS, state)
    mine, yours = one.step(p, v, frames), other.step(p, v, frames)
    np.testing.assert_array_equal(mine.acceleration, yours.acceleration)
    assert mine.component == yours.component


def test_a_path_is_cut_at_its_longest():
    executor = Executor(MODEL, SETTINGS)
    executor.begin(np.array([-0.7, 0.2]), np.zeros(2), still())
    path = executor.predict(np.array([-0.7, 0.2]), np.zeros(2), still(), max_points=7)
    assert len(path.points_world) == 7
    assert not path.done


def test_malformed_input_is_refused_and_changes_nothing():
    executor, good = Executor(MODEL, SETTINGS), np.array([-0.7, 0.2])
    with pytest.raises(InvalidInput, match="begin"):
        executor.step(good, np.zeros(2), still())
    executor.begin(good, np.zeros(2), still())
    state = executor.state()
    for position, velocity, frames in (
        (np.array([np.nan, 0.0]), np.zeros(2), still()),
        (np.zeros(3), np.zeros(2), still()),
        (good, np.array([np.inf, 0.0]), still()),
        (good, np.zeros(2), still() * 2),
        (good, np.zeros(2), [TaskFrame.identity(3)]),
    ):
        for call in (executor.step, executor.begin, executor.predict):
            with pytest.raises(InvalidInput):
                call(position, velocity, frames)
    assert executor.state() is state


def test_a_model_that_never_ends_cannot_be_executed():
    with pytest.raises(InvalidModel, match="terminal"):
        Executor(replace(MODEL, terminal=np.zeros(MODEL.n_components, bool), ways=()), SETTINGS)


def test_settings_that_do_not_fit_are_refused():
    for values in (
        {"dt_s": 0.0},
        {"max_speed_m_s": -1.0},
        {"control_horizon_s": 2.0},
        {"horizon_s": float("nan")},
    ):
        with pytest.raises(InvalidConfiguration):
            ExecutorSettings(**values)


def test_warming_up_needs_no_model():
    for space in (2, 3, POSE):
        warm_up(space)
