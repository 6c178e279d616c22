from __future__ import annotations

import numpy as np
import pytest

from farhand.common.model.manifold import POSE
from farhand.common.task import Target
from farhand.remote_site.perception.simulated_sight import (
    CLEAN,
    TYPICAL,
    MarkerTracker,
    OscillatingTarget,
    SimulatedPerception,
    TrackerNoise,
)
from farhand.remote_site.perception.target_filter import AdaptiveFilter

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


def origin(perception: SimulatedPerception, now_s: float) -> np.ndarray:
    frames = perception.observe(now_s)
    assert frames is not None
    return frames[0].b


@pytest.mark.parametrize("seed", range(3))
def test_the_estimate_is_better_than_its_measurements(seed: int):
    target = OscillatingTarget(TARGET)
    perception = SimulatedPerception.of_oscillating(target, 0.01, seed)
    times = 0.02 * np.arange(1000)
    errors = np.array([origin(perception, t) - target.origin_m(t) for t in times])[200:]
    assert np.sqrt((errors**2).mean()) < 0.5 * 0.01


def test_the_noise_is_seeded():
    one, same, other = (
        origin(SimulatedPerception.of_oscillating(OscillatingTarget(TARGET), 0.01, seed), 0.0).tolist() for seed in (1, 1, 2)
    )  # fmt: skip
    assert one == same != other


def test_the_truth_is_the_target_itself():
    target = OscillatingTarget(TARGET)
    perception = SimulatedPerception.of_oscillating(target, 0.01, 0)
    np.testing.assert_array_equal(perception.true_origin_m(2.2), target.origin_m(2.2))
    target.move_to(np.array([0.2, 0.2]), 3.0)
    np.testing.assert_allclose(perception.true_origin_m(10.0), [0.2, 0.2], atol=0.1 + 1e-9)


def tracked(noise: TrackerNoise, seed: int = 0) -> SimulatedPerception:
    """Sight of a receptacle that moves along x at 5 cm/s."""
    return SimulatedPerception(
        lambda t: np.array([0.8 + 0.05 * t, 0.0, 0.4, np.cos(0.4), 0.0, np.sin(0.4), 0.0]),
        MarkerTracker(POSE, noise, seed),
        AdaptiveFilter((noise.jitter_m, noise.jitter_rad)),
    )


def test_a_pose_is_seen_as_a_frame_that_is_turned():
    perception = tracked(CLEAN)
    frames = perception.observe(0.0)
    assert frames is not None
    np.testing.assert_allclose(frames[0].quat_wxyz, [np.cos(0.4), 0.0, np.sin(0.4), 0.0], atol=1e-12)
    np.testing.assert_allclose(perception.true_origin_m(2.0), [0.9, 0.0, 0.4])


def test_the_latency_is_made_up_for_by_prediction():
    perception = tracked(TrackerNoise(latency_s=0.06))
    observed = [perception.observe(0.01 * n) for n in range(600)]
    assert observed[0] is None  # nothing has arrived yet
    last = observed[-1]
    assert last is not None
    np.testing.assert_allclose(last[0].b, perception.true_origin_m(5.99), atol=5e-4)


def test_a_few_missing_measurements_are_no_loss_of_sight_but_many_are():
    perception = tracked(TYPICAL)
    seen = [perception.observe(0.01 * n) is not None for n in range(1000)]
    assert np.mean(seen[20:]) > 0.97
    perception.in_sight = False
    gone = [perception.observe(10.0 + 0.01 * n) is None for n in range(100)]
    assert not any(gone[:10]) and all(gone[30:])
    perception.in_sight = True
    back = [perception.observe(11.0 + 0.01 * n) is not None for n in range(50)]
    assert not any(back[:6]) and all(back[20:])
