from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from tests.strategies import dims, seeds, stroke


def taught(
    rng: np.random.Generator, n_dims: int, n: int
) -> tuple[OnlineLearner, list[NDArray], list[NDArray]]:
    learner, motions, labels = OnlineLearner(LearnerSettings(0.3), n_dims), [], []
    for _ in range(n):
        motions.append(stroke(rng, n_dims, 100))
        learner.start()
        times = (0.02 * np.arange(100.0)).tolist()
        labels.append(learner.observe_many(motions[-1], [TaskFrame.identity(n_dims)], times))
        learner.end()
    return learner, motions, labels


@settings(deadline=None, derandomize=True, max_examples=15)
@given(seed=seeds, n_dims=dims)
def test_means_and_covariances_equal_batch_statistics_to_a_relative_1e_12(seed: int, n_dims: int):
    learner, motions, labels = taught(np.random.default_rng(seed), n_dims, 4)
    model, floor = learner.model(), learner.settings.min_std**2 * np.eye(n_dims)
    points, labels = np.concatenate(motions), np.concatenate(labels)
    for i in np.flatnonzero(~model.terminal):
        mine = points[labels == i]
        mean, covariance = mine.mean(axis=0), np.cov(mine.T, bias=True) + floor
        assert np.linalg.norm(model.means[0, i] - mean) <= 1e-12 * np.linalg.norm(mean)
        off = np.linalg.norm(model.covariances[0, i] - covariance)
        assert off <= 1e-12 * np.linalg.norm(covariance)


@settings(deadline=None, derandomize=True, max_examples=15)
@given(seed=seeds, n_dims=dims)
def test_the_ramp_is_the_least_squares_line_through_the_assigned_points(seed: int, n_dims: int):
    learner, (motion,), (labels,) = taught(np.random.default_rng(seed), n_dims, 1)
    model = learner.model()
    floor = learner.settings.min_std**2 * np.eye(n_dims)
    for i in np.flatnonzero(~model.terminal):
        samples = np.flatnonzero(labels == i)
        if np.any(np.diff(samples) > 1) or samples[0] == 0 or samples.size < 5:
            continue
        elapsed = 0.02 * np.arange(1, samples.size + 1)
        line = np.linalg.lstsq(
            np.stack([np.ones_like(elapsed), elapsed], axis=1), motion[samples], rcond=None
        )[0]
        shrunk = elapsed.var() / (elapsed.var() + 0.01**2)  # the floor of the elapsed time's variance
        np.testing.assert_allclose(model.slopes[0, i], shrunk * line[1], atol=1e-9)
        np.testing.assert_allclose(model.elapsed_mean_s[i], elapsed.mean(), atol=1e-12)
        centred = motion[samples] - motion[samples].mean(axis=0)
        scatter = centred.T @ centred / samples.size
        explained = shrunk * (2.0 - shrunk) * np.outer(line[1], line[1]) * elapsed.var()
        np.testing.assert_allclose(model.residual_covariances[0, i], scatter - explained + floor, atol=1e-9)


@settings(deadline=None, derandomize=True, max_examples=15)
@given(seed=seeds)
def test_starts_are_those_of_the_demonstrations_that_visited(seed: int):
    learner, motions, labels = taught(np.random.default_rng(seed), 2, 3)
    model = learner.model()
    for i in np.flatnonzero(~model.terminal):
        starts = np.concatenate(
            [np.repeat(m[:1], (k == i).sum(), axis=0) for m, k in zip(motions, labels, strict=True)]
        )
        np.testing.assert_allclose(model.start_means[0, i], starts.mean(axis=0), atol=1e-12)


@pytest.mark.parametrize("at", [20, 90])
def test_a_pause_of_one_demonstration_does_not_outweigh_the_others(at: int):
    """Ten seconds at rest in one of three strokes of two seconds, seen by a sensor with a millimetre of noise.

    Counted in full they are worth more than three times the datapoints of all in a component, and draw it to themselves.
    """
    rng, models = np.random.default_rng(1), []
    line = np.linspace([1.0, 0.0, 0.0], [0.0, 0.0, 0.0], 100)
    for rest in (0, 500):
        learner = OnlineLearner(LearnerSettings(0.3), 3)
        for beside in (-0.02, 0.0, 0.02):
            motion, n = line + np.array([0.0, beside, 0.0]), rest if beside == 0.0 else 0
            points = np.concatenate([motion[:at], np.repeat(motion[at : at + 1], n, axis=0), motion[at:]])
            points[at : at + n] += 0.001 * rng.normal(size=(n, 3))
            learner.start()
            learner.observe_many(points, [TaskFrame.identity(3)], 0.02 * np.arange(float(len(points))))
            learner.end()
        models.append(learner.model())
    without, paused = models
    np.testing.assert_array_equal(paused.transition > 0, without.transition > 0)
    np.testing.assert_allclose(paused.means, without.means, atol=0.03)
    ramps, exact = (model.slopes[0] * model.duration_mean_s[:, None] for model in (paused, without))
    np.testing.assert_allclose(
        ramps, exact, atol=0.15
    )  # of half a metre; nothing is left of it if the pause counts
    np.testing.assert_allclose(paused.time_share, without.time_share, atol=0.01)
    assert np.isclose(paused.duration_mean_s.sum() - without.duration_mean_s.sum(), 10.0 / 3.0, atol=0.1)


def test_the_end_of_a_motion_has_no_ramp():
    learner, _, _ = taught(np.random.default_rng(2), 3, 4)
    model = learner.model()
    assert not model.slopes[:, model.terminal].any()


def test_a_model_of_an_unfinished_demonstration_is_valid():
    learner = OnlineLearner(LearnerSettings(0.3), 2)
    learner.start()
    learner.observe(np.zeros(2), [TaskFrame.identity(2)], 0.0)
    model = learner.model()
    assert (model.n_components, model.n_paths, model.n_demonstrations) == (1, 0, 0)
