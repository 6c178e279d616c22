"""The components of a model as the present task frames put them into the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.gaussian_product import gaussian_product, inverse
from common.task_frame import TaskFrame
from common.tphsmm import TPHSMM
from remote_site.reproduction.gaussians import Gaussians

Array = NDArray[np.float64]

# The start regression goes no further than so many standard deviations from the demonstrated starts.
_FARTHEST_START = 3.0


@dataclass(frozen=True, eq=False)
class WorldComponents:
    """What the tracker and the reference need, for one set of frames.

    Args:
        frames: The task frames that it holds for.
        gaussians: The products of Eq. 9.
        entries: Where the ramp of each component begins [m]. Shape (K, C).
        ramps: The tangent from there to where it ends [m, rad]. Shape (K, T).
        precisions: Its tracking cost, from the residual covariances [1/m^2, 1/rad^2]. Shape (K, T, T).
        factors: Precisions of the single frames in the world. Shape (P, K, T, T).
    """

    frames: tuple[TaskFrame, ...]
    gaussians: Gaussians
    entries: Array
    ramps: Array
    precisions: Array
    factors: Array

    @classmethod
    def seen(cls, model: TPHSMM, shift: Array, frames: tuple[TaskFrame, ...]) -> WorldComponents:
        """The components for the present frames.

        Args:
            model: The learned task.
            shift: Moves the means, from the start of the motion [m, rad]. Shape (P, K, T).
            frames: The present task frames. Length P.
        """
        space = model.manifold
        shifted = space.exp(model.means, shift)
        means, covariances = gaussian_product(shifted, model.covariances, frames)
        before = model.slopes * model.elapsed_mean_s[:, None]
        after = model.slopes * (model.duration_mean_s - model.elapsed_mean_s)[:, None]
        entries, residual = gaussian_product(space.exp(shifted, -before), model.residual_covariances, frames)
        exits, _ = gaussian_product(space.exp(shifted, after), model.residual_covariances, frames)
        factors = inverse(
            np.stack(
                [f.covariance_to_world(c) for f, c in zip(frames, model.residual_covariances, strict=True)]
            )
        )
        precisions = inverse(residual)
        gaussians = Gaussians.of(means, covariances, entries, exits, precisions)
        return cls(frames, gaussians, entries, space.log(entries, exits), precisions, factors)

    def valid_for(self, frames: tuple[TaskFrame, ...]) -> bool:
        """Whether these frames are the same."""
        return all(
            a is b or (np.array_equal(a.b, b.b) and np.array_equal(a.A, b.A))
            for a, b in zip(frames, self.frames, strict=True)
        )

    def weights(self, component: int) -> Array:
        """Share of each frame in a component's mean; they sum to the identity. Shape (P, T, T)."""
        factors = self.factors[:, component]
        return np.linalg.solve(factors.sum(axis=0), factors)


def start_shift(model: TPHSMM, start: Array | None) -> Array:
    """How a start moves the means of the components (start regression) [m, rad]. Shape (P, K, T).

    Args:
        model: The learned task.
        start: Where the motion began in each frame; None when not where demonstrations began. Shape (P, C).
    """
    if start is None:
        return np.zeros_like(model.slopes)
    e = model.manifold.log(model.start_means, start[:, None])
    for part in model.manifold.parts:  # far from the demonstrated starts the robot joins the learned way
        C = model.start_covariances[..., part, part]
        away = np.sqrt(np.einsum("pkd,pkd->pk", e[..., part], np.linalg.solve(C, e[..., part, None])[..., 0]))
        e[..., part] *= np.minimum(1.0, _FARTHEST_START / np.maximum(away, _FARTHEST_START))[..., None]
    return np.einsum("pkde,pke->pkd", model.start_gains, e)
