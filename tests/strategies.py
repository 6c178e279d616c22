"""Hypothesis strategies and seeded examples for the method's tests."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import special_ortho_group

from common.task_frame import TaskFrame
from common.tphsmm import TPHSMM
from local_site.learning.online_learner import LearnerSettings, OnlineLearner

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


def recording(rng: np.random.Generator, n_dims: int, n_points: int) -> tuple[Array, Array]:
    """A stroke and increasing, uneven times."""
    return stroke(rng, n_dims, n_points), np.cumsum(rng.uniform(0.01, 0.03, size=n_points))


def learned(
    n_dims: int = 2,
    n_frames: int = 1,
    n_demonstrations: int = 3,
    seed: int = 0,
    settings: LearnerSettings | None = None,
) -> TPHSMM:
    """A small model of strokes to the origin of every frame."""
    rng = np.random.default_rng(seed)
    names = [f"frame {j}" for j in range(n_frames)]
    learner = OnlineLearner(settings or LearnerSettings(0.2), n_dims, names)
    for _ in range(n_demonstrations):
        learner.start()
        points = stroke(rng, n_dims, 150)
        learner.observe_many(points, [TaskFrame.identity(n_dims)] * n_frames, 0.02 * np.arange(150.0))
        learner.end()
    return learner.model()


seeds = st.integers(0, 2**32 - 1)
dims = st.sampled_from([2, 3])
frame_counts = st.sampled_from([1, 2])
