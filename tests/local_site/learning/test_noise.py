"""What the noise of a sensor must not change: components, durations, and where a motion ends."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray

from farhand.common.model.manifold import POSE
from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from tests.strategies import seeds

LAMBDA_M, HERE = 0.1, [TaskFrame.identity(3)]


def hand(rate_hz: float, duration_s: float = 5.0) -> tuple[NDArray, NDArray]:
    """Times, and a way of 0.9 m round a corner that turns by a radian, at rest at both ends. Shape (T, 7)."""
    time_s = np.linspace(0.0, duration_s, round(rate_hz * duration_s) + 1)
    tau = time_s / duration_s
    s = (10 * tau**3 - 15 * tau**4 + 6 * tau**5)[:, None]
    corner, begin = np.array([0.5, 0.0, 0.1]), np.array([0.5, 0.4, 0.3])
    position = (1 - s) ** 2 * begin + 2 * s * (1 - s) * corner
    return time_s, POSE.exp(
        POSE.exp(np.eye(7)[3], np.zeros(6)), np.hstack([position, (1 - s) * [0.6, 0.8, 0]])
    )


def noisy(points: NDArray, random: np.random.Generator, mm: float, degrees: float) -> NDArray:
    std = np.repeat([1e-3 * mm, np.radians(degrees)], 3)
    return POSE.exp(points, std * random.normal(size=(len(points), 6)))


def learner_of(times: NDArray, *motions: NDArray) -> OnlineLearner:
    learner = OnlineLearner(LearnerSettings(LAMBDA_M), POSE)
    for points in motions:
        learner.start()
        learner.observe_many(points, HERE, times)
        learner.end()
    return learner


@pytest.mark.parametrize("rate_hz", [10.0, 50.0, 100.0, 1000.0])
@pytest.mark.parametrize(("mm", "degrees"), [(0.5, 0.2), (1.0, 0.5), (2.0, 1.0)])
def test_noise_of_a_sensor_founds_no_components(rate_hz: float, mm: float, degrees: float):
    times, points = hand(rate_hz)
    random = np.random.default_rng(0)
    exact = learner_of(times, *[points] * 3).n_components
    seen = learner_of(times, *[noisy(points, random, mm, degrees) for _ in range(3)]).n_components
    assert abs(seen - exact) <= max(1, 0.3 * exact)


def test_a_hand_that_rests_for_long_travels_nowhere_however_noisy_its_sensor_is():
    times, points = hand(100.0)
    rest = np.repeat(points[:1], 2000, axis=0)
    random = np.random.default_rng(1)
    learner = OnlineLearner(LearnerSettings(LAMBDA_M), POSE)
    learner.start()
    learner.observe_many(noisy(rest, random, 2.0, 1.0), HERE, 0.01 * np.arange(2000.0))
    first = learner.n_components
    learner.observe_many(noisy(points, random, 2.0, 1.0), HERE, 20.0 + times)
    learner.end()
    assert first == 1
    assert learner.n_components <= learner_of(times, points).n_components + 1


@settings(deadline=None, derandomize=True, max_examples=10)
@given(seed=seeds)
def test_the_end_is_nearer_to_the_hand_s_than_the_last_datapoint_is(seed: int):
    """Over twelve ends: their errors' mean square is at most half of the last datapoints' own."""
    times, points = hand(50.0)
    random = np.random.default_rng(seed)
    ours, last = [], []
    for _ in range(12):
        seen = noisy(points, random, 2.0, 1.0)
        model = learner_of(times, seen).model()
        end = model.means[0, np.flatnonzero(model.terminal)[0]]
        ours.append(POSE.log(points[-1], end))
        last.append(POSE.log(points[-1], seen[-1]))
    for part in POSE.parts:
        assert np.mean(np.square(ours)[:, part]) <= 0.5 * np.mean(np.square(last)[:, part])


def test_an_exact_sensor_s_last_datapoint_is_the_end_even_of_a_motion_that_does_not_stop():
    times, points = hand(50.0)
    cut = slice(0, 160)  # at its full speed
    model = learner_of(times[cut], points[cut]).model()
    end = model.means[0, np.flatnonzero(model.terminal)[0]]
    assert np.abs(POSE.log(points[cut][-1], end)).max() < 1e-4


def test_a_marker_that_is_lost_for_a_moment_teaches_nothing():
    times, points = hand(100.0)
    exact = learner_of(times, points)
    jumped = points.copy()
    for first, last, away in ((50, 51, 0.3), (200, 215, -0.4), (330, 350, 0.5)):
        jumped[first:last, :3] += away
    lost = learner_of(times, jumped)
    assert lost.n_components == exact.n_components
    assert lost.n_points == exact.n_points - 36
    here, there = lost.model(), exact.model()
    assert np.abs(here.means - there.means).max() < 0.04  # what was reported from elsewhere is missing
    assert np.isclose(here.duration_mean_s.sum(), there.duration_mean_s.sum())


def test_a_marker_that_is_lost_at_the_very_end_does_not_move_the_end():
    times, points = hand(100.0)
    jumped = points.copy()
    jumped[-8:, :3] += 0.4
    model = learner_of(times, jumped).model()
    end = model.means[0, np.flatnonzero(model.terminal)[0]]
    assert np.linalg.norm(end[:3]) < 0.002


def test_a_motion_that_really_jumps_and_stays_loses_no_datapoint():
    times, points = hand(100.0)
    points[300:, :3] += 0.4
    learner = learner_of(times, points)
    assert learner.n_points == len(points)


@pytest.mark.parametrize("size", [1, 7, 50])
def test_datapoints_that_are_held_back_teach_the_same_in_pieces_of_any_size(size: int):
    times, points = hand(100.0)
    points[120:130, :3] += 0.3
    points[300:, :3] += 0.4
    whole, pieces = learner_of(times, points), OnlineLearner(LearnerSettings(LAMBDA_M), POSE)
    pieces.start()
    for first in range(0, len(points), size):
        pieces.observe_many(points[first : first + size], HERE, times[first : first + size])
    pieces.end()
    assert pieces.model() == whole.model()


def test_missing_datapoints_are_no_jump():
    times, points = hand(100.0)
    kept = np.ones(len(times), np.bool_)
    kept[200:270] = False
    learner = learner_of(times[kept], points[kept])
    assert (
        learner.n_points >= 0.95 * kept.sum()
    )  # the others are taken for a rest, as long as the sensor seems bad
    assert np.isclose(learner.model().duration_mean_s.sum(), times[-1])


def test_a_coarse_sensor_founds_no_components():
    times, points = hand(50.0)
    coarse = points.copy()
    coarse[:, :3] = 0.005 * np.round(points[:, :3] / 0.005)
    assert learner_of(times, coarse).n_components <= learner_of(times, points).n_components + 1


def test_discarding_a_demonstration_forgets_what_is_held_back():
    times, points = hand(100.0)
    points[-5:, :3] += 0.4
    learner = learner_of(times, hand(100.0)[1])
    before = [array.tobytes() for array in learner.snapshot().arrays()]
    learner.start()
    learner.observe_many(points, HERE, times)
    learner.discard()
    assert [array.tobytes() for array in learner.snapshot().arrays()] == before
