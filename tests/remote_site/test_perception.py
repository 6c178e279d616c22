from __future__ import annotations

import numpy as np
import pytest

from common.task import Target
from remote_site.perception import OscillatingTarget, PositionFilter, SimulatedPerception

TARGET = Target(origin_m=(0.7, 0.3), amplitude_m=(0.1, 0.03), period_s=5.0, noise_std_m=0.002)
STILL = Target(origin_m=(0.7, 0.3), amplitude_m=(0.0, 0.0))


def test_the_target_oscillates_about_its_mean_with_its_period():
    target = OscillatingTarget(TARGET, phase_rad=0.4)
    times = np.arange(0.0, 5.0, 0.005)
    places = np.array([target.origin_m(t) for t in times])
    np.testing.assert_allclose(places.mean(axis=0), TARGET.origin_m, atol=1e-9)
    np.testing.assert_allclose(np.ptp(places, axis=0), [0.2, 0.06], atol=1e-4)
    np.testing.assert_allclose(target.origin_m(1.3), target.origin_m(6.3), atol=1e-12)


def test_a_moved_mean_slides_there_and_never_jumps():
    target = OscillatingTarget(STILL, slide_m_s=0.3)
    target.move_to(np.array([0.1, 0.3]), 10.0)
    places = np.array([target.origin_m(t) for t in np.arange(10.0, 13.0, 0.01)])
    np.testing.assert_allclose(places[0], [0.7, 0.3])
    np.testing.assert_allclose(places[-1], [0.1, 0.3])
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() <= 0.3 * 0.01 + 1e-12
    np.testing.assert_allclose(places[100], [0.4, 0.3])


def test_a_mean_that_is_moved_again_on_its_way_goes_on_from_there():
    target = OscillatingTarget(STILL, slide_m_s=0.3)
    target.move_to(np.array([0.1, 0.3]), 10.0)
    target.move_to(np.array([0.7, 0.3]), 11.0)
    np.testing.assert_allclose(target.origin_m(11.0), [0.4, 0.3])
    np.testing.assert_allclose(target.origin_m(13.0), [0.7, 0.3])


def test_the_first_estimate_is_the_first_measurement():
    measured = np.array([0.2, 0.9])
    np.testing.assert_array_equal(PositionFilter(0.01).update(measured, 3.0), measured)


def test_an_estimate_follows_a_target_at_constant_velocity_without_lag():
    estimate, velocity = np.zeros(2), np.array([0.1, -0.05])
    position_filter = PositionFilter(0.002)
    for n in range(500):
        estimate = position_filter.update(velocity * 0.02 * n, 0.02 * n)
    np.testing.assert_allclose(estimate, velocity * 0.02 * 499, atol=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_the_estimate_is_better_than_its_measurements(seed: int):
    target = OscillatingTarget(TARGET)
    perception = SimulatedPerception(target, 0.01, seed)
    times = 0.02 * np.arange(1000)
    errors = np.array([perception.observe(t)[0].b - target.origin_m(t) for t in times])[200:]
    assert np.sqrt((errors**2).mean()) < 0.5 * 0.01


def test_the_noise_is_seeded():
    one, same, other = (
        [SimulatedPerception(OscillatingTarget(TARGET), 0.01, seed).observe(0.0)[0].b.tolist()] for seed in (1, 1, 2)
    )  # fmt: skip
    assert one == same != other


def test_the_truth_is_the_target_itself():
    target = OscillatingTarget(TARGET)
    perception = SimulatedPerception(target, 0.01, 0)
    np.testing.assert_array_equal(perception.true_origin_m(2.2), target.origin_m(2.2))
    perception.move_to(np.array([0.2, 0.2]), 3.0)
    np.testing.assert_allclose(perception.true_origin_m(10.0), [0.2, 0.2], atol=0.1 + 1e-9)
