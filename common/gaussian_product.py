"""The product of a component's Gaussians over the task frames (Eqs. 8 and 9)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from common.errors import InvalidInput
from common.manifold import Manifold
from common.task_frame import TaskFrame

Array = NDArray[np.float64]

_MAX_STEPS = 20
_CONVERGED = 1e-10


def gaussian_product(means: Array, covariances: Array, frames: Sequence[TaskFrame]) -> tuple[Array, Array]:
    """Gaussians of all components in the world, given the present task frames.

    The mean is where the product of the densities is largest, found by Gauss-Newton steps from the first
    frame's mean; for positions the first step is the closed form of Eq. 9. Where frames disagree about an
    orientation by nearly half a turn, that maximum is the one nearest to the first frame's.

    Args:
        means: Means mu_i^(j) in each frame [m]. Shape (P, K, C).
        covariances: Covariances Sigma_i^(j) in each frame [m^2, rad^2]. Shape (P, K, T, T).
        frames: The present task parameters. Length P.

    Returns:
        World means (K, C) and covariances (K, T, T).

    Raises:
        InvalidInput: When the number or dimension of the frames is not the model's.
    """
    space = Manifold.of(means.shape[2], covariances.shape[3])
    check_frames(frames, means.shape[0], space.n_dims)
    world = np.stack([frame.to_world(mu) for frame, mu in zip(frames, means, strict=True)])  # Eq. 8
    sigma = np.stack([frame.covariance_to_world(c) for frame, c in zip(frames, covariances, strict=True)])
    if len(frames) == 1:  # the product of one factor
        return world[0], sigma[0]
    precisions, x, product = inverse(sigma), world[0], sigma[0]
    for _ in range(_MAX_STEPS):
        e = space.log(world, x)  # log(mu_j, exp(x, t)) = e_j + J(e_j)^-1 t
        J = inverse(space.jacobian(e))
        weighted = np.swapaxes(J, -1, -2) @ precisions
        product = inverse((weighted @ J).sum(axis=0))  # Eq. 9
        step = -np.einsum("kde,pkef,pkf->kd", product, weighted, e)
        x = space.exp(x, step)
        if not space.oriented or np.abs(step).max() < _CONVERGED:
            break
    return x, 0.5 * (product + np.swapaxes(product, -1, -2))


def check_frames(frames: Sequence[TaskFrame], n_frames: int, n_dims: int) -> None:
    """Refuse frames that do not fit a model of P frames in D dimensions."""
    if len(frames) != n_frames:
        raise InvalidInput("task frames", "", f"{n_frames} frames, as the model has, got {len(frames)}")
    for index, frame in enumerate(frames):
        if frame.n_dims != n_dims:
            raise InvalidInput("task frames", f"frame {index}", f"dimension {n_dims}, got {frame.n_dims}")


def inverse(matrices: Array) -> Array:
    """Inverses of the matrices in the last two axes. Shape (..., T, T)."""
    return np.asarray(np.linalg.inv(matrices), dtype=np.float64)
