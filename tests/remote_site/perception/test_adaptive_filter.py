from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from farhand.common.model.manifold import POSE
from farhand.remote_site.perception.simulated_sight import TYPICAL, MarkerTracker
from farhand.remote_site.perception.target_filter import AdaptiveFilter

HOME = np.array([0.8, 0.0, 0.4, np.cos(0.4), 0.0, np.sin(0.4), 0.0])
STD = (TYPICAL.jitter_m, TYPICAL.jitter_rad)


class Run:
    """What the filter made of a tracker's measurements of a target; errors without the tracker's bias."""

    def __init__(self, truth: Callable[[float], np.ndarray], seed: int, for_s: float = 12.0):
        target_filter = AdaptiveFilter(STD)
        tracker = MarkerTracker(POSE, TYPICAL, seed)
        errors, squares, quiet, jumps = [], [], [], []
        for n in range(round(100 * for_s)):
            t = 0.01 * n
            for measurement in tracker.look(truth(t), t):
                target_filter.update(*measurement)
            if target_filter.time_s is None or n % 5:
                continue
            estimate = target_filter.estimate(t)
            error = POSE.log(truth(t), estimate.point) - tracker.bias
            errors.append(error)
            squares.append(error @ np.linalg.solve(estimate.covariance, error))
            quiet.append(estimate.quiet)
            jumps.append(estimate.jumps)
        self.error, self.square, self.quiet = np.array(errors), np.array(squares), np.array(quiet)
        self.jumps = np.array(jumps)


def swaying(amplitude_m: float, hz: float) -> Callable[[float], np.ndarray]:
    return lambda t: POSE.exp(HOME, np.array([0, amplitude_m * np.sin(2 * np.pi * hz * t), 0, 0, 0, 0]))


def stepping(by_m: float, within_s: float = 0.3, from_s: float = 5.0) -> Callable[[float], np.ndarray]:
    return lambda t: POSE.exp(HOME, np.array([by_m * np.clip((t - from_s) / within_s, 0, 1), 0, 0, 0, 0, 0]))


@pytest.mark.parametrize("seed", range(4))
def test_a_target_at_rest_is_known_much_better_than_measured(seed: int):
    run = Run(lambda t: HOME, seed)
    assert run.quiet.all() and run.jumps[-1] == 0
    late = run.error[40:]
    assert np.sqrt((late[:, :3] ** 2).mean()) < 0.4 * TYPICAL.jitter_m
    assert np.sqrt((late[:, 3:] ** 2).mean()) < 0.4 * TYPICAL.jitter_rad


@pytest.mark.parametrize(("amplitude_m", "hz"), [(0.02, 0.1), (0.05, 0.2)])
def test_sway_is_followed_and_never_taken_for_a_jump(amplitude_m: float, hz: float):
    runs = [Run(swaying(amplitude_m, hz), seed) for seed in range(4)]
    assert all(run.jumps[-1] == 0 for run in runs)
    late = np.concatenate([run.error[60:] for run in runs])
    assert np.sqrt((late[:, 1] ** 2).mean()) < 0.006


@pytest.mark.parametrize("truth", [lambda t: HOME, swaying(0.02, 0.1), swaying(0.05, 0.2)])
def test_the_covariance_is_honest(truth: Callable[[float], np.ndarray]):
    """The mean normalised squared error is that of six numbers, or a little less where the motion is tame."""
    squares = np.concatenate([Run(truth, seed).square[40:] for seed in range(5)])
    assert 0.5 * 6 < squares.mean() < 1.2 * 6


@pytest.mark.parametrize("seed", range(3))
def test_a_target_that_was_put_elsewhere_is_found_there_at_once(seed: int):
    run = Run(stepping(0.15, within_s=1e-6), seed)
    assert run.jumps[-1] == 1
    settled = 20 * 5 + 8  # 0.4 s after it: the latency, a drop-out or two, and two measurements
    assert np.abs(run.error[settled:, 0]).max() < 4 * TYPICAL.jitter_m


@pytest.mark.parametrize("seed", range(3))
def test_a_step_of_five_centimetres_is_followed(seed: int):
    run = Run(stepping(0.05), seed)
    assert np.abs(run.error[20 * 6 :, 0]).max() < 0.02
    assert not run.quiet[20 * 6 : 20 * 8].any()


def test_a_single_outlier_changes_nothing():
    target_filter, same = AdaptiveFilter(STD), AdaptiveFilter(STD)
    for n in range(60):
        for each in (target_filter, same):
            each.update(HOME, n / 30)
    target_filter.update(POSE.exp(HOME, np.array([0.3, 0, 0, 0, 0, 0])), 2.0)
    np.testing.assert_array_equal(target_filter.estimate(2.1).point, same.estimate(2.1).point)
    assert target_filter.estimate(2.1).jumps == 0


def test_a_target_at_rest_again_is_quiet_again():
    run = Run(stepping(0.05, from_s=3.0), 1, for_s=16.0)
    assert not run.quiet[20 * 4 : 20 * 6].any() and run.quiet[-20:].all()
