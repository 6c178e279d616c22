from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from farhand.common.errors import InvalidConfiguration, InvalidDemonstration
from farhand.common.model.manifold import POSE
from farhand.common.model.model_file import decode, encode
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from tests.strategies import pose_stroke, random_frame, seeds

SETTINGS = LearnerSettings(0.1)
FRAMES = [TaskFrame.identity(3)]
FLIP = np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0])


def learn(
    demonstrations: list[NDArray], frames: list[list[TaskFrame]] | None = None
) -> tuple[TPHSMM, NDArray]:
    """The model, and the component of every datapoint."""
    learner, labels = OnlineLearner(SETTINGS, POSE), []
    for number, points in enumerate(demonstrations):
        learner.start()
        at = FRAMES if frames is None else frames[number]
        labels.append(learner.observe_many(points, at, 0.02 * np.arange(float(len(points)))))
        learner.end()
    return learner.model(), np.concatenate(labels)


def karcher(points: NDArray) -> tuple[NDArray, NDArray]:
    """Batch mean and covariance on the manifold, by iteration."""
    mean = points[0]
    for _ in range(50):
        mean = POSE.exp(mean, POSE.log(mean, points).mean(axis=0))
    e = POSE.log(mean, points)
    return mean, e.T @ e / len(e)


@settings(deadline=None, derandomize=True, max_examples=10)
@given(seed=seeds)
def test_means_and_covariances_are_the_karcher_statistics_of_the_assigned_poses(seed: int):
    rng = np.random.default_rng(seed)
    demonstrations = [pose_stroke(rng, 200) for _ in range(5)]
    model, labels = learn(demonstrations)
    points = np.concatenate(demonstrations)
    floor = np.diag([SETTINGS.min_std**2] * 3 + [SETTINGS.min_std_rad**2] * 3)
    for i in np.flatnonzero(~model.terminal):
        mean, covariance = karcher(points[labels == i])
        off = POSE.log(mean, model.means[0, i])
        np.testing.assert_allclose(off[:3], 0.0, atol=1e-12)
        assert np.linalg.norm(off[3:]) < 1e-3
        learned = model.covariances[0, i] - floor
        np.testing.assert_allclose(learned[:3, :3], covariance[:3, :3], atol=1e-12)
        for rows in (slice(3, 6), slice(0, 3)):
            expected = covariance[rows, 3:]
            difference = np.linalg.norm(learned[rows, 3:] - expected)
            # what is below the floor is not seen in the model
            assert difference <= 0.01 * np.linalg.norm(expected) + 1e-4 * SETTINGS.min_std_rad**2


@settings(deadline=None, derandomize=True, max_examples=10)
@given(seed=seeds)
def test_seen_from_another_frame_the_same_is_learned(seed: int):
    rng = np.random.default_rng(seed)
    points, frames, moved, moved_frames = [], [], [], []
    for _ in range(3):
        points.append(pose_stroke(rng, 100))
        frame, world = random_frame(rng, 3), random_frame(rng, 3)
        frames.append([frame])
        moved.append(world.to_world(points[-1]))
        moved_frames.append([TaskFrame(world.A @ frame.A, world.to_world(frame.b))])
    one, other = learn(points, frames)[0], learn(moved, moved_frames)[0]
    for name in ("means", "start_means"):
        a, b = getattr(one, name), getattr(other, name)
        np.testing.assert_allclose(POSE.log(a, b), 0.0, atol=1e-9, err_msg=name)
    for name in (
        "covariances",
        "slopes",
        "residual_covariances",
        "start_covariances",
        "transition",
    ):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-8, err_msg=name)


@settings(deadline=None, derandomize=True, max_examples=10)
@given(seed=seeds)
def test_learning_in_a_turned_frame_is_the_model_turned(seed: int):
    """Re-expressing and learning commute: the mean turns, its covariance in body axes does not."""
    rng = np.random.default_rng(seed)
    points, turn = [pose_stroke(rng, 100) for _ in range(2)], random_frame(rng, 3)
    one, other = learn(points)[0], learn([turn.to_world(x) for x in points])[0]
    np.testing.assert_allclose(POSE.log(turn.to_world(one.means), other.means), 0.0, atol=1e-9)
    np.testing.assert_allclose(turn.covariance_to_world(one.covariances), other.covariances, atol=1e-9)


@settings(deadline=None, derandomize=True, max_examples=10)
@given(seed=seeds, signs=st.integers(0, 2**32 - 1))
def test_the_signs_of_quaternions_do_not_matter(seed: int, signs: int):
    points = pose_stroke(np.random.default_rng(seed), 100)
    flipped = np.where(np.random.default_rng(signs).random((100, 1)) < 0.5, points * FLIP, points)
    one, other = learn([points])[0], learn([flipped])[0]
    np.testing.assert_allclose(POSE.log(one.means, other.means), 0.0, atol=1e-12)
    np.testing.assert_allclose(one.covariances, other.covariances, atol=1e-12)


def test_a_tool_that_turns_in_place_by_more_than_half_a_turn_is_learned():
    angle = np.linspace(0.0, 1.5 * np.pi, 300)
    points = POSE.exp(
        np.array([0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0]), angle[:, None] * np.array([0, 0, 0, 0, 0, 1.0])
    )
    model, labels = learn([points])
    assert model.n_components > 3
    for i in np.flatnonzero(~model.terminal):
        assert POSE.distance(points[labels == i], model.means[0, i], 1.0).max() < 2.0
    inner = ~model.terminal
    rates = model.slopes[0, inner, 5]
    np.testing.assert_allclose(rates, 1.5 * np.pi / (299 * 0.02), rtol=0.05)


def test_a_model_of_poses_survives_its_file():
    model = learn([pose_stroke(np.random.default_rng(0), 100)])[0]
    kept = decode(encode(model))
    assert kept.manifold == POSE
    assert kept.n_dims == 3
    np.testing.assert_allclose(POSE.log(model.means, kept.means), 0.0, atol=1e-6)


@pytest.mark.parametrize("factor", [0.0, 0.5, 2.0, np.nan])
def test_quaternions_that_are_none_are_refused_and_change_nothing(factor: float):
    learner, good = OnlineLearner(SETTINGS, POSE), pose_stroke(np.random.default_rng(0), 20)
    learner.start()
    learner.observe_many(good, FRAMES, 0.02 * np.arange(20.0))
    before = encode(learner.model())
    bad = good[-1] * np.array([1, 1, 1, factor, factor, factor, factor])
    with pytest.raises(InvalidDemonstration, match=r"points: (unit quaternions|finite)"):
        learner.observe(bad, FRAMES, 1.0)
    assert encode(learner.model()) == before


def test_a_component_cannot_be_allowed_to_span_half_a_turn():
    with pytest.raises(InvalidConfiguration, match="rotation_weight"):
        LearnerSettings(0.1, rotation_weight=0.1)
    with pytest.raises(InvalidConfiguration, match="min_std_rad"):
        LearnerSettings(0.1, min_std_rad=0.0)
