"""The components of a model as the present task frames put them into the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.gaussian_product import gaussian_product
from common.task_frame import TaskFrame
from common.tphsmm import TPHSMM
from remote_site.reproduction.progress import Gaussians

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WorldComponents:
    """What the tracker and the reference need, for one set of frames.

    Args:
        frames: The task frames that it holds for.
        gaussians: The products of Eq. 9.
        entries: Where the ramp of each component begins [m]. Shape (K, D).
        exits: Where it ends [m]. Shape (K, D).
        precisions: Its tracking cost, from the residual covariances [1/m^2]. Shape (K, D, D).
        factors: Precisions of the single frames in the world [1/m^2]. Shape (P, K, D, D).
    """

    frames: tuple[TaskFrame, ...]
    gaussians: Gaussians
    entries: Array
    exits: Array
    precisions: Array
    factors: Array

    @classmethod
    def seen(cls, model: TPHSMM, shift: Array, frames: tuple[TaskFrame, ...]) -> WorldComponents:
        """The components for the present frames.

        Args:
            model: The learned task.
            shift: Added to the means, from the start of the motion [m]. Shape (P, K, D).
            frames: The present task frames. Length P.
        """
        means, covariances = gaussian_product(model.means + shift, model.covariances, frames)
        local_entries = model.means + shift - model.slopes * model.elapsed_mean_s[:, None]
        local_exits = local_entries + model.slopes * model.duration_mean_s[:, None]
        entries, residual = gaussian_product(local_entries, model.residual_covariances, frames)
        exits, _ = gaussian_product(local_exits, model.residual_covariances, frames)
        factors = _inverse(
            np.stack(
                [f.covariance_to_world(c) for f, c in zip(frames, model.residual_covariances, strict=True)]
            )
        )
        gaussians = Gaussians(means, covariances, _inverse(covariances))
        return cls(frames, gaussians, entries, exits, _inverse(residual), factors)

    def valid_for(self, frames: tuple[TaskFrame, ...]) -> bool:
        """Whether these frames are the same."""
        return all(
            a is b or (np.array_equal(a.b, b.b) and np.array_equal(a.A, b.A))
            for a, b in zip(frames, self.frames, strict=True)
        )

    def weights(self, component: int) -> Array:
        """Share of each frame in a component's mean; they sum to the identity. Shape (P, D, D)."""
        factors = self.factors[:, component]
        return np.linalg.solve(factors.sum(axis=0), factors)


def start_shift(model: TPHSMM, start: Array | None) -> Array:
    """How a start moves the means of the components (start regression) [m]. Shape (P, K, D).

    Args:
        model: The learned task.
        start: Where the motion began in each frame [m]; None when not where demonstrations began. Shape (P, D).
    """
    if start is None:
        return np.zeros_like(model.means)
    return np.einsum("pkde,pke->pkd", model.start_gains, start[:, None] - model.start_means)


def _inverse(matrices: Array) -> Array:
    return np.asarray(np.linalg.inv(matrices), dtype=np.float64)
