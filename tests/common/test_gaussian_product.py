from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.stats import multivariate_normal

from common.errors import InvalidInput
from common.gaussian_product import gaussian_product
from common.task_frame import TaskFrame
from tests.strategies import dims, random_covariances, random_frame, seeds


def test_two_gaussians_on_a_line_have_the_closed_form_product():
    means = np.array([[[1.0]], [[4.0]]])
    variances = np.array([[[[0.5]]], [[[2.0]]]])
    mean, variance = gaussian_product(means, variances, [TaskFrame.identity(1)] * 2)
    assert variance[0, 0, 0] == pytest.approx(0.5 * 2.0 / 2.5, rel=1e-12)
    assert mean[0, 0] == pytest.approx((1.0 * 2.0 + 4.0 * 0.5) / 2.5, rel=1e-12)


@settings(deadline=None, derandomize=True, max_examples=25)
@given(seed=seeds, n_dims=dims)
def test_the_product_is_proportional_to_the_densities_multiplied(seed: int, n_dims: int):
    rng = np.random.default_rng(seed)
    P, K = 3, 2
    means, sigma = rng.normal(size=(P, K, n_dims)), random_covariances(rng, P, K, n_dims)
    frames = [random_frame(rng, n_dims) for _ in range(P)]
    mu, cov = gaussian_product(means, sigma, frames)
    points = rng.normal(size=(5, n_dims))
    for i in range(K):
        logs = np.zeros(5)
        for j, frame in enumerate(frames):
            # the density in the frame's own coordinates, an independent way round Eq. 8
            logs += multivariate_normal(means[j, i], sigma[j, i]).logpdf(frame.to_local(points))
        offset = logs - multivariate_normal(mu[i], cov[i]).logpdf(points)
        assert np.ptp(offset) < 1e-7 * max(1.0, np.abs(logs).max())


@settings(deadline=None, derandomize=True, max_examples=25)
@given(seed=seeds, n_dims=dims)
def test_the_product_moves_with_the_frames(seed: int, n_dims: int):
    rng = np.random.default_rng(seed)
    means, sigma = rng.normal(size=(2, 3, n_dims)), random_covariances(rng, 2, 3, n_dims)
    frames = [random_frame(rng, n_dims) for _ in range(2)]
    world = random_frame(rng, n_dims)
    moved = [TaskFrame(world.A @ f.A, world.to_world(f.b)) for f in frames]
    mu, cov = gaussian_product(means, sigma, frames)
    moved_mu, moved_cov = gaussian_product(means, sigma, moved)
    np.testing.assert_allclose(moved_mu, world.to_world(mu), atol=1e-9)
    np.testing.assert_allclose(moved_cov, world.covariance_to_world(cov), atol=1e-9)


def test_frames_that_do_not_fit_the_model_are_refused():
    means, sigma = np.zeros((1, 2, 2)), np.broadcast_to(np.eye(2), (1, 2, 2, 2))
    with pytest.raises(InvalidInput, match="1 frames"):
        gaussian_product(means, sigma, [TaskFrame.identity(2)] * 2)
    with pytest.raises(InvalidInput, match="dimension 2"):
        gaussian_product(means, sigma, [TaskFrame.identity(3)])
