from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

from farhand.common.errors import InvalidInput
from farhand.common.model.gaussian_product import frame_shares, gaussian_product, idle_frames
from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from tests.strategies import dims, random_covariances, random_frame, random_points, seeds, spaces


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


def agreeing(rng: np.random.Generator, space: Manifold, P: int, K: int, apart: float) -> tuple:
    """Gaussians that the frames put near each other in the world: anisotropic, up to so far apart."""
    frames = [random_frame(rng, space.n_dims) for _ in range(P)]
    centres = random_points(rng, space, K)
    world = space.exp(centres, apart * rng.uniform(-1.0, 1.0, size=(P, K, space.n_tangent)))
    means = np.stack([frame.to_local(x) for frame, x in zip(frames, world, strict=True)])
    return means, random_covariances(rng, P, K, space.n_tangent), frames


@settings(deadline=None, derandomize=True, max_examples=25)
@given(seed=seeds, space=spaces)
def test_the_product_is_where_the_densities_multiplied_are_largest(seed: int, space: Manifold):
    rng = np.random.default_rng(seed)
    means, sigma, frames = agreeing(rng, space, 3, 2, apart=0.4)
    mu, cov = gaussian_product(means, sigma, frames)

    def cost(i: int, x: NDArray) -> float:
        total = 0.0
        for j, frame in enumerate(frames):
            e = space.log(means[j, i], frame.to_local(x))
            total += 0.5 * e @ np.linalg.solve(sigma[j, i], e)
        return total

    for i in range(2):
        least = cost(i, mu[i])
        for e in 1e-3 * np.eye(space.n_tangent):
            ahead, behind = cost(i, space.exp(mu[i], e)), cost(i, space.exp(mu[i], -e))
            assert min(ahead, behind) >= least
            assert (ahead - behind) / 2e-3 == pytest.approx(0.0, abs=2e-3 * (1.0 + least))
        assert np.linalg.eigvalsh(cov[i]).min() > 0.0


def test_frames_that_disagree_by_half_a_turn_still_give_a_pose_and_always_the_same():
    rng = np.random.default_rng(0)
    means = random_points(rng, POSE, 2, 4)
    means[1] = POSE.exp(means[0], np.array([0.0, 0.0, 0.0, 0.0, np.pi, 0.0]))
    sigma, frames = random_covariances(rng, 2, 4, 6), [TaskFrame.identity(3)] * 2
    mu, cov = gaussian_product(means, sigma, frames)
    assert np.isfinite(mu).all()
    np.testing.assert_allclose(np.linalg.norm(mu[:, 3:], axis=1), 1.0, atol=1e-12)
    np.testing.assert_array_equal(mu, gaussian_product(means, sigma, frames)[0])
    assert np.linalg.eigvalsh(cov).min() > 0.0


@settings(deadline=None, derandomize=True, max_examples=25)
@given(seed=seeds, space=spaces)
def test_the_product_moves_with_the_frames(seed: int, space: Manifold):
    rng = np.random.default_rng(seed)
    means, sigma, frames = agreeing(rng, space, 2, 3, apart=0.4)
    world = random_frame(rng, space.n_dims)
    moved = [TaskFrame(world.A @ f.A, world.to_world(f.b)) for f in frames]
    mu, cov = gaussian_product(means, sigma, frames)
    moved_mu, moved_cov = gaussian_product(means, sigma, moved)
    np.testing.assert_allclose(space.log(moved_mu, world.to_world(mu)), 0.0, atol=1e-7)
    np.testing.assert_allclose(moved_cov, world.covariance_to_world(cov), atol=1e-7)


def test_frames_that_do_not_fit_the_model_are_refused():
    means, sigma = np.zeros((1, 2, 2)), np.broadcast_to(np.eye(2), (1, 2, 2, 2))
    with pytest.raises(InvalidInput, match="1 frames"):
        gaussian_product(means, sigma, [TaskFrame.identity(2)] * 2)
    with pytest.raises(InvalidInput, match="dimension 2"):
        gaussian_product(means, sigma, [TaskFrame.identity(3)])


def test_the_shares_of_the_frames_sum_to_one_and_the_narrow_one_has_most():
    covariances = np.stack([np.stack([0.01 * np.eye(3)] * 2), np.stack([0.0001 * np.eye(3), np.eye(3)])])
    shares = frame_shares(covariances)
    np.testing.assert_allclose(shares.sum(axis=0), 1.0)
    np.testing.assert_allclose(shares[1], [100 / 101, 1 / 101])


def test_a_frame_is_idle_when_it_decides_neither_the_motion_nor_any_component():
    counts = np.array([50, 50, 100])
    base, bystander, handle = [0.98, 1 / 3, 0.02], [0.01, 1 / 3, 0.01], [0.01, 1 / 3, 0.97]
    assert idle_frames(np.array([base, bystander, handle]), counts) == [1]
    via = [0.01, 0.96, 0.01]  # short, but its own
    assert idle_frames(np.array([base, via, handle]), np.array([100, 5, 100])) == []
