"""The product of a component's Gaussians over the task frames (Eqs. 8 and 9)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from common.errors import InvalidInput
from common.task_frame import TaskFrame

Array = NDArray[np.float64]


def gaussian_product(means: Array, covariances: Array, frames: Sequence[TaskFrame]) -> tuple[Array, Array]:
    """Gaussians of all components in the world, given the present task frames.

    Args:
        means: Means mu_i^(j) in each frame [m]. Shape (P, K, D).
        covariances: Covariances Sigma_i^(j) in each frame [m^2]. Shape (P, K, D, D).
        frames: The present task parameters. Length P.

    Returns:
        World means (K, D) [m] and covariances (K, D, D) [m^2].

    Raises:
        InvalidInput: When the number or dimension of the frames is not the model's.
    """
    check_frames(frames, *means.shape[::2])
    if len(frames) == 1:  # the product of one factor
        return frames[0].to_world(means[0]), frames[0].covariance_to_world(covariances[0])
    world = np.stack([frame.to_world(mu) for frame, mu in zip(frames, means, strict=True)])  # Eq. 8
    sigma = np.stack([frame.covariance_to_world(c) for frame, c in zip(frames, covariances, strict=True)])
    precisions = np.linalg.inv(sigma)
    product = np.linalg.inv(precisions.sum(axis=0))  # Eq. 9
    product = 0.5 * (product + np.swapaxes(product, -1, -2))
    information = np.einsum("pkde,pke->kd", precisions, world)
    return np.einsum("kde,ke->kd", product, information), product


def check_frames(frames: Sequence[TaskFrame], n_frames: int, n_dims: int) -> None:
    """Refuse frames that do not fit a model of P frames in D dimensions."""
    if len(frames) != n_frames:
        raise InvalidInput("task frames", "", f"{n_frames} frames, as the model has, got {len(frames)}")
    for index, frame in enumerate(frames):
        if frame.n_dims != n_dims:
            raise InvalidInput("task frames", f"frame {index}", f"dimension {n_dims}, got {frame.n_dims}")
