from __future__ import annotations

import math

import numpy as np
import pytest

from farhand.common.errors import InvalidConfiguration
from farhand.common.model.manifold import POSE, Manifold
from farhand.remote_site.perception.simulated_sight import (
    CLEAN,
    TYPICAL,
    MarkerTracker,
    Measurement,
    TrackerNoise,
)

HOME = np.array([0.8, 0.0, 0.4, np.cos(0.4), 0.0, np.sin(0.4), 0.0])


def seen(noise: TrackerNoise, seed: int = 0, for_s: float = 60.0) -> list[Measurement]:
    tracker = MarkerTracker(POSE, noise, seed)
    return [m for n in range(round(100 * for_s)) for m in tracker.look(HOME, 0.01 * n)]


def test_a_clean_tracker_sees_the_truth_at_its_rate():
    measurements = seen(CLEAN, for_s=10.0)
    assert len(measurements) == pytest.approx(300, abs=1)
    for measurement in measurements:
        np.testing.assert_allclose(measurement.point, HOME, atol=1e-15)
    assert np.diff([m.taken_s for m in measurements]).max() == pytest.approx(0.04)


def test_measurements_arrive_after_the_latency_and_are_of_the_moment_they_were_taken():
    tracker = MarkerTracker(Manifold(2), TrackerNoise(latency_s=0.06), 0)
    for n in range(100):
        for point, taken_s in tracker.look(np.array([0.01 * n, 0.0]), 0.01 * n):
            assert 0.01 * n - taken_s == pytest.approx(0.06)
            assert point[0] == pytest.approx(taken_s)


def test_the_jitter_has_its_deviation_about_the_bias():
    tracker = MarkerTracker(POSE, TYPICAL, 4)
    errors = np.array(
        [POSE.log(HOME, m.point) for n in range(9000) for m in tracker.look(HOME, n / 90)]
    ) - tracker.bias  # fmt: skip
    np.testing.assert_allclose(errors.mean(axis=0), 0.0, atol=4 * 0.035 / math.sqrt(len(errors)))
    np.testing.assert_allclose(errors[:, :3].std(axis=0), 0.005, rtol=0.07)
    np.testing.assert_allclose(errors[:, 3:].std(axis=0), math.radians(2.0), rtol=0.07)


def test_the_bias_has_its_deviation_over_the_seeds():
    biases = np.array([MarkerTracker(POSE, TYPICAL, seed).bias for seed in range(300)])
    np.testing.assert_allclose(biases[:, :3].std(), 0.003, rtol=0.08)
    np.testing.assert_allclose(biases[:, 3:].std(), math.radians(1.0), rtol=0.08)


def test_its_share_of_the_measurements_is_missing():
    assert len(seen(TrackerNoise(dropout=0.3))) == pytest.approx(0.7 * 1800, abs=60)
    assert not seen(TrackerNoise(dropout=1.0))


def test_nothing_is_measured_while_the_target_is_out_of_sight():
    tracker = MarkerTracker(POSE, CLEAN, 0)
    assert tracker.look(HOME, 0.0) and not tracker.look(None, 0.1) and tracker.look(HOME, 0.2)


def test_one_seed_gives_the_same_errors():
    for one, other in zip(seen(TYPICAL, 7, 2.0), seen(TYPICAL, 7, 2.0), strict=True):
        np.testing.assert_array_equal(one.point, other.point)
    assert not np.array_equal(seen(TYPICAL, 7, 1.0)[0].point, seen(TYPICAL, 8, 1.0)[0].point)


@pytest.mark.parametrize(
    ("field", "value"), [("dropout", 1.1), ("rate_hz", 0.0), ("jitter_m", -1.0), ("latency_s", math.nan)]
)
def test_a_number_out_of_range_is_named(field: str, value: float):
    with pytest.raises(InvalidConfiguration, match=field):
        TrackerNoise(**{field: value})
