from __future__ import annotations

import numpy as np
import pytest

from farhand.common.model.manifold import POSE, Manifold
from farhand.remote_site.perception.target_filter import TargetFilter, TargetMotion

PLANE = Manifold(2)
MOTION = TargetMotion((1e-3, 1e-2), (0.1, 0.2))
STD = (0.005, 0.035)
HOME = np.array([0.8, 0.0, 0.4, np.cos(0.4), 0.0, np.sin(0.4), 0.0])


def test_the_first_estimate_is_the_first_measurement():
    target_filter = TargetFilter(PLANE, (0.01,), TargetMotion((2e-3,), (1.0,)))
    target_filter.update(np.array([0.2, 0.9]), 3.0)
    np.testing.assert_array_equal(target_filter.estimate(3.0).point, [0.2, 0.9])
    assert target_filter.time_s == 3.0


@pytest.mark.parametrize("space", [PLANE, POSE])
def test_a_target_at_constant_velocity_is_followed_without_lag(space: Manifold):
    start = HOME if space.oriented else np.array([0.2, 0.9])
    velocity = np.array([0.05, -0.02, 0.03, 0.1, -0.2, 0.1])[: space.n_tangent]
    parts = len(space.parts)
    motion = TargetMotion(MOTION.acceleration_density[:parts], MOTION.speed_std[:parts])
    target_filter = TargetFilter(space, STD[:parts], motion)
    for n in range(300):
        target_filter.update(space.exp(start, 0.02 * n * velocity), 0.02 * n)
    estimate = target_filter.estimate(0.02 * 299 + 0.06)
    np.testing.assert_allclose(
        space.log(space.exp(start, (0.02 * 299 + 0.06) * velocity), estimate.point), 0.0, atol=1e-3
    )
    np.testing.assert_allclose(estimate.velocity, velocity, atol=2e-3)


def test_positions_are_filtered_as_the_textbook_says():
    """The oracle has the whole state of one axis in matrices, as in any textbook, and inverts what it must."""
    rng = np.random.default_rng(3)
    target_filter = TargetFilter(PLANE, (0.01,), TargetMotion((2e-3,), (0.5,)))
    x, P, H = np.zeros(2), np.diag([1e-4, 0.25]), np.array([[1.0, 0.0]])
    t = 0.0
    for n in range(40):
        dt = 0.0 if n == 0 else rng.uniform(0.01, 0.1)
        t += dt
        measured = rng.normal(size=2)
        F, Q = np.array([[1, dt], [0, 1]]), 2e-3 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        if n == 0:
            x = np.array([measured[0], 0.0])
        else:
            x, P = F @ x, F @ P @ F.T + Q
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + 1e-4)
            x, P = x + K @ (measured[:1] - H @ x), (np.eye(2) - K @ H) @ P
        target_filter.update(measured, t)
        estimate = target_filter.estimate(t)
        np.testing.assert_allclose([estimate.point[0], estimate.velocity[0]], x, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(estimate.covariance, P[0, 0] * np.eye(2), rtol=1e-9)


def test_a_target_that_is_not_measured_is_expected_to_come_to_rest():
    target_filter = TargetFilter(PLANE, (0.001,), TargetMotion((1e-3,), (0.1,)))
    for n in range(100):
        target_filter.update(np.array([0.1 * 0.02 * n, 0.0]), 0.02 * n)
    last = target_filter.estimate(0.02 * 99)
    soon, late, later = (target_filter.estimate(0.02 * 99 + s) for s in (0.15, 5.0, 50.0))
    np.testing.assert_allclose(soon.point[0] - last.point[0], 0.15 * last.velocity[0], rtol=1e-9)
    np.testing.assert_allclose(later.point, late.point, atol=1e-5)
    assert late.velocity[0] < 1e-4 < soon.velocity[0]
    assert later.covariance[0, 0] > late.covariance[0, 0] > soon.covariance[0, 0] > last.covariance[0, 0]


def test_its_covariance_is_honest_for_the_motion_that_it_expects():
    """The normalised squared error of a target that moves as modelled has the mean of its dimension."""
    rng = np.random.default_rng(0)
    dt, squares = 0.04, []
    q = np.repeat(MOTION.acceleration_density, 3)
    for _ in range(40):
        target_filter = TargetFilter(POSE, STD, MOTION)
        pose, v = HOME, rng.normal(size=6) * np.repeat(MOTION.speed_std, 3)
        for n in range(40):
            target_filter.update(POSE.exp(pose, rng.normal(size=6) * np.repeat(STD, 3)), dt * n)
            estimate = target_filter.estimate(dt * n)
            if n % 10 == 9:
                error = POSE.log(pose, estimate.point)
                squares.append(error @ np.linalg.solve(estimate.covariance, error))
            # White acceleration over dt: of velocity and way, with their correlation.
            noise = np.linalg.cholesky(np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]))
            way, change = np.sqrt(q) * (noise @ rng.normal(size=(2, 6)))
            pose, v = POSE.exp(pose, dt * v + way), v + change
    assert 5.2 < np.mean(squares) < 6.8  # 160 values: 6 +- 0.27


def test_nothing_is_estimated_before_anything_was_measured():
    with pytest.raises(ValueError, match="nothing was measured"):
        TargetFilter(PLANE, (0.01,), TargetMotion((1e-3,), (1.0,))).estimate(0.0)
