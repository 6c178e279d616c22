"""Hypothesis strategies and seeded examples for the method's tests."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import special_ortho_group

from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner

Array = NDArray[np.float64]


def random_frame(rng: np.random.Generator, n_dims: int) -> TaskFrame:
    rotation = special_ortho_group.rvs(n_dims, random_state=rng)
    return TaskFrame(rotation, rng.normal(size=n_dims))


def random_covariances(rng: np.random.Generator, *shape: int) -> Array:
    """Symmetric positive definite matrices of shape (..., D, D)."""
    root = rng.normal(size=(*shape, shape[-1]))
    return root @ np.swapaxes(root, -1, -2) + 0.1 * np.eye(shape[-1])


def stroke(rng: np.random.Generator, n_dims: int, n_points: int, noise: float = 0.002) -> Array:
    """A smooth motion that comes to rest at the origin. Shape (n_points, D) [m]."""
    tau = np.linspace(0.0, 1.0, n_points)
    s = (10 * tau**3 - 15 * tau**4 + 6 * tau**5)[:, None]
    begin, bend = rng.normal(size=n_dims), 0.5 * rng.normal(size=n_dims)
    begin = 0.8 * begin / np.linalg.norm(begin)
    return (1 - s) * begin + s * (1 - s) * bend + noise * rng.normal(size=(n_points, n_dims))


def random_points(rng: np.random.Generator, space: Manifold, *shape: int) -> Array:
    """Points anywhere, with orientations all over the sphere. Shape (*shape, C)."""
    points = rng.normal(size=(*shape, space.n_coordinates))
    points[..., space.n_dims :] /= np.linalg.norm(points[..., space.n_dims :], axis=-1, keepdims=True)
    return points


def pose_stroke(rng: np.random.Generator, n_points: int, noise: float = 0.0005) -> Array:
    """A smooth motion that turns by about a radian on its way, with quaternions of any sign. Shape (n, 7)."""
    tau = np.linspace(0.0, 1.0, n_points)
    s = (10 * tau**3 - 15 * tau**4 + 6 * tau**5)[:, None]
    turn = (1 - s) * 0.6 * rng.normal(size=3) + noise * rng.normal(size=(n_points, 3))
    end = np.array([0.0, 0.0, 0.0, 0.6, 0.8, 0.0, 0.0])
    points = POSE.exp(end, np.hstack([stroke(rng, 3, n_points, noise), turn]))
    points[:, 3:] *= rng.choice([-1.0, 1.0], size=(n_points, 1))
    return points


def recording(rng: np.random.Generator, n_dims: int, n_points: int) -> tuple[Array, Array]:
    """A stroke and increasing, uneven times."""
    return stroke(rng, n_dims, n_points), np.cumsum(rng.uniform(0.01, 0.03, size=n_points))


def learned(
    space: Manifold | int = 2,
    n_frames: int = 1,
    n_demonstrations: int = 3,
    seed: int = 0,
    settings: LearnerSettings | None = None,
) -> TPHSMM:
    """A small model of strokes to the origin of every frame."""
    rng = np.random.default_rng(seed)
    names = [f"frame {j}" for j in range(n_frames)]
    learner = OnlineLearner(settings or LearnerSettings(0.2), space, names)
    for _ in range(n_demonstrations):
        learner.start()
        n_dims = learner.space.n_dims
        points = pose_stroke(rng, 150) if learner.space.oriented else stroke(rng, n_dims, 150)
        learner.observe_many(points, [TaskFrame.identity(n_dims)] * n_frames, 0.02 * np.arange(150.0))
        learner.end()
    return learner.model()


seeds = st.integers(0, 2**32 - 1)
dims = st.sampled_from([2, 3])
spaces = st.sampled_from([Manifold(2), Manifold(3), POSE])
frame_counts = st.sampled_from([1, 2])
