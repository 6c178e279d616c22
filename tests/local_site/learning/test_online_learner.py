from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from farhand.common.errors import InvalidConfiguration, InvalidDemonstration, InvalidInput, InvalidModel
from farhand.common.model.manifold import Manifold
from farhand.common.model.model_file import encode
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import ARRAY_FIELDS
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner, Snapshot
from tests.strategies import dims, frame_counts, pose_stroke, random_frame, recording, seeds, spaces

SETTINGS = LearnerSettings(0.2)


def demonstrate(learner: OnlineLearner, points: NDArray, times: NDArray, frames: list[TaskFrame]) -> None:
    learner.start()
    learner.observe_many(points, frames, times.tolist())
    learner.end()


def state_of(snapshot: Snapshot) -> list[bytes]:
    return [array.tobytes() for array in snapshot.arrays()]


@settings(deadline=None, derandomize=True, max_examples=20)
@given(seed=seeds, n_dims=dims, n_frames=frame_counts, n_demonstrations=st.integers(1, 4))
def test_the_invariants_of_the_count_form_hold(seed: int, n_dims: int, n_frames: int, n_demonstrations: int):
    rng = np.random.default_rng(seed)
    names = [f"frame {j}" for j in range(n_frames)]
    learner = OnlineLearner(SETTINGS, n_dims, names)
    n_points, total_s = 0, 0.0
    for _ in range(n_demonstrations):
        points, times = recording(rng, n_dims, 80)
        frames = [random_frame(rng, n_dims) for _ in names]
        world = frames[0].to_world(points)
        demonstrate(learner, world, times, frames)
        n_points, total_s = n_points + len(points), total_s + float(np.ptp(times))
    model = learner.model()
    inner = ~model.terminal
    assert model.counts[inner].sum() == learner.n_points == n_points
    assert model.counts[model.terminal].sum() == learner.n_demonstrations == n_demonstrations
    np.testing.assert_allclose(model.transition.sum(axis=1) + model.exit, 1.0, atol=1e-12)
    dwell = learner.snapshot().dwell
    assert dwell.transitions.sum() == dwell.visits.sum()
    assert dwell.ends.sum() == dwell.starts.sum() == n_demonstrations
    np.testing.assert_allclose((dwell.visits * dwell.mean).sum(), total_s, atol=1e-9)
    floor = SETTINGS.min_std**2 * np.eye(n_dims)
    for covariances in (model.covariances, model.residual_covariances):
        assert np.linalg.eigvalsh(covariances - floor).min() >= -1e-12
    assert 1 <= model.n_paths <= n_demonstrations


@settings(deadline=None, derandomize=True, max_examples=20)
@given(seed=seeds, cuts=st.lists(st.integers(0, 100), max_size=6))
def test_a_stream_in_chunks_gives_the_bit_identical_model(seed: int, cuts: list[int]):
    rng = np.random.default_rng(seed)
    points, times = recording(rng, 2, 100)
    frame = random_frame(rng, 2)
    whole, parts = OnlineLearner(SETTINGS, 2), OnlineLearner(SETTINGS, 2)
    demonstrate(whole, points, times, [frame])
    parts.start()
    for part in np.split(np.arange(100), sorted(cuts)):
        parts.observe_many(points[part].reshape(-1, 2), [frame], times[part].tolist())
    parts.end()
    assert encode(parts.model()) == encode(whole.model())


def test_one_by_one_is_the_same_as_many_also_when_the_arrays_grow():
    rng = np.random.default_rng(7)
    points, times = recording(rng, 3, 200)
    settings_fine = LearnerSettings(0.01)  # more components than there is room for at first
    frames = [TaskFrame.identity(3)]
    many, single = OnlineLearner(settings_fine, 3), OnlineLearner(settings_fine, 3)
    demonstrate(many, points, times, frames)
    single.start()
    for point, time_s in zip(points, times, strict=True):
        single.observe(point, frames, float(time_s))
    single.end()
    assert many.n_components > 64
    assert encode(single.model()) == encode(many.model())


@settings(deadline=None, derandomize=True, max_examples=15)
@given(seed=seeds, taken=st.integers(0, 60))
def test_undo_and_discard_restore_every_bit(seed: int, taken: int):
    rng = np.random.default_rng(seed)
    learner = OnlineLearner(SETTINGS, 2)
    demonstrate(learner, *recording(rng, 2, 60), [TaskFrame.identity(2)])
    before, model = learner.snapshot(), learner.model()

    points, times = recording(rng, 2, 60)
    learner.start()
    learner.observe_many(points[:taken], [TaskFrame.identity(2)], times[:taken].tolist())
    learner.discard()
    assert state_of(learner.snapshot()) == state_of(before)
    assert not learner.demonstrating

    demonstrate(learner, points, times, [TaskFrame.identity(2)])
    assert learner.model() != model
    learner.restore(before)
    assert state_of(learner.snapshot()) == state_of(before)
    assert learner.model() == model


def test_the_state_does_not_grow_with_the_points():
    learner = OnlineLearner(SETTINGS, 2)
    angle = np.linspace(0.0, 2.0 * np.pi, 100)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    sizes = []
    for n in (1, 30):
        for _ in range(n):
            demonstrate(learner, circle, 0.02 * np.arange(100.0), [TaskFrame.identity(2)])
        sizes.append(sum(map(len, state_of(learner.snapshot()))))
    assert sizes[0] == sizes[1]
    assert learner.n_points == 3100


@settings(deadline=None, derandomize=True, max_examples=20)
@given(seed=seeds, n_dims=dims)
def test_demonstrations_seen_from_elsewhere_give_the_same_model(seed: int, n_dims: int):
    rng = np.random.default_rng(seed)
    here, there = OnlineLearner(SETTINGS, n_dims), OnlineLearner(SETTINGS, n_dims)
    for _ in range(2):
        points, times = recording(rng, n_dims, 80)
        frame, world = random_frame(rng, n_dims), random_frame(rng, n_dims)
        demonstrate(here, points, times, [frame])
        moved = TaskFrame(world.A @ frame.A, world.to_world(frame.b))
        demonstrate(there, world.to_world(points), times, [moved])
    one, other = here.model(), there.model()
    for name in ARRAY_FIELDS:
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-8, err_msg=name)


def test_frames_that_move_during_a_demonstration_are_used_as_they_were():
    rng = np.random.default_rng(5)
    points, times = recording(rng, 2, 80)
    still, moving = OnlineLearner(SETTINGS, 2), OnlineLearner(SETTINGS, 2)
    demonstrate(still, points, times, [TaskFrame.identity(2)])
    frames = [[TaskFrame(np.eye(2), np.array([0.1 * t, 0.0]))] for t in range(80)]
    world = np.stack([f[0].to_world(p) for f, p in zip(frames, points, strict=True)])
    moving.start()
    moving.observe_many(world, frames, times.tolist())
    moving.end()
    np.testing.assert_allclose(moving.model().means, still.model().means, atol=1e-12)


@settings(deadline=None, derandomize=True, max_examples=10)
@given(seed=seeds, space=spaces, n_frames=frame_counts)
def test_what_each_frame_observed_by_itself_teaches_the_same_as_the_world(
    seed: int, space: Manifold, n_frames: int
):
    rng = np.random.default_rng(seed)
    names = [f"frame {j}" for j in range(n_frames)]
    world, local = OnlineLearner(SETTINGS, space, names), OnlineLearner(SETTINGS, space, names)
    for _ in range(2):
        points = pose_stroke(rng, 60) if space.oriented else recording(rng, space.n_dims, 60)[0]
        frames, times = [random_frame(rng, space.n_dims) for _ in names], 0.02 * np.arange(60.0)
        demonstrate(world, points, times, frames)
        local.start()
        local.observe_in_frames(np.stack([f.to_local(points) for f in frames], axis=1), times.tolist())
        local.end()
    one, other = world.model(), local.model()
    np.testing.assert_allclose(space.log(one.means, other.means), 0.0, atol=1e-12)
    for name in ("covariances", "transition", "duration_mean_s"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-12, err_msg=name)


FRAMES = [TaskFrame.identity(2)]
MALFORMED: dict[str, Callable[[OnlineLearner], object]] = {
    "a NaN": lambda x: x.observe(np.array([0.0, np.nan]), FRAMES, 9.0),
    "a NaN among good ones": lambda x: x.observe_many(
        np.array([[0.0, 0.0], [np.inf, 0.0]]), FRAMES, [9.0, 9.1]
    ),
    "a wrong shape": lambda x: x.observe(np.zeros(3), FRAMES, 9.0),
    "a wrong number of times": lambda x: x.observe_many(np.zeros((2, 2)), FRAMES, [9.0]),
    "time that goes backwards": lambda x: x.observe(np.zeros(2), FRAMES, 0.5),
    "time that stands still": lambda x: x.observe_many(np.zeros((2, 2)), FRAMES, [9.0, 9.0]),
    "a time that is no number": lambda x: x.observe(np.zeros(2), FRAMES, float("nan")),
    "too many frames": lambda x: x.observe(np.zeros(2), FRAMES * 2, 9.0),
    "a frame of another dimension": lambda x: x.observe(np.zeros(2), [TaskFrame.identity(3)], 9.0),
    "the observations of a frame too many": lambda x: x.observe_in_frames(np.zeros((1, 2, 2)), [9.0]),
    "a second start": lambda x: x.start(),
}


@pytest.mark.parametrize("what", MALFORMED)
def test_malformed_input_is_refused_and_changes_nothing(what: str):
    learner = OnlineLearner(SETTINGS, 2)
    learner.start()
    learner.observe_many(np.linspace([0.0, 0.0], [1.0, 0.0], 20), FRAMES, np.linspace(0.0, 1.0, 20).tolist())
    before = state_of(learner.snapshot())
    with pytest.raises(InvalidInput):
        MALFORMED[what](learner)
    assert state_of(learner.snapshot()) == before


def test_what_needs_a_demonstration_says_so():
    learner = OnlineLearner(SETTINGS, 2)
    for action in (learner.end, learner.discard, lambda: learner.observe(np.zeros(2), FRAMES, 0.0)):
        with pytest.raises(InvalidDemonstration):
            action()
    with pytest.raises(InvalidModel, match="at least one demonstration"):
        learner.model()
    learner.start()
    learner.observe(np.zeros(2), FRAMES, 0.0)
    with pytest.raises(InvalidDemonstration, match="two datapoints"):
        learner.end()


def test_settings_out_of_range_are_refused():
    for max_distance_m, min_std_m in ((0.0, None), (0.1, -1.0)):
        with pytest.raises(InvalidConfiguration):
            LearnerSettings(max_distance_m, min_std_m)
    with pytest.raises(InvalidConfiguration, match="frame_rule: one of all, goal"):
        LearnerSettings(0.1, frame_rule="last")
    with pytest.raises(InvalidConfiguration, match="hysteresis"):
        LearnerSettings(0.1, hysteresis=float("nan"))
