"""The components of a model as the present task frames put them into the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.gaussian_product import inverse, product
from farhand.common.model.kernel import kernel
from farhand.common.model.manifold import Manifold, log_at
from farhand.common.model.small_matrix import invert
from farhand.common.model.task_frame import FrameArrays, TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.remote_site.reproduction.gaussians import Gaussians

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LocalComponents:
    """What is the same wherever the task frames are: all in the frames' own coordinates.

    Args:
        space: Positions or poses.
        means: Of the components. Shape (P, K, C).
        entries: Where the ramp of each component begins. Shape (P, K, C).
        exits: Where it ends. Shape (P, K, C).
        precisions: Inverse covariances. Shape (P, K, T, T).
        residual_precisions: Inverses of what the ramp leaves. Shape (P, K, T, T).
    """

    space: Manifold
    means: Array
    entries: Array
    exits: Array
    precisions: Array
    residual_precisions: Array

    @classmethod
    def of(cls, model: TPHSMM) -> LocalComponents:
        """The components of a model."""
        space, means = model.manifold, model.means
        before = model.slopes * model.elapsed_mean_s[:, None]
        after = model.slopes * (model.duration_mean_s - model.elapsed_mean_s)[:, None]
        return cls(
            space,
            means,
            space.exp(means, -before),
            space.exp(means, after),
            inverse(model.covariances),
            inverse(model.residual_covariances),
        )

    def seen(self, frames: Sequence[TaskFrame]) -> WorldComponents:
        """The components for the present frames. Length P."""
        arrays = FrameArrays.of(frames, self.space.oriented)
        means, precisions, parts, entries, exits, ramps, tracking = _seen(
            self.means, self.precisions, self.entries, self.exits, self.residual_precisions, arrays
        )
        gaussians = Gaussians(self.space, means, precisions, parts, entries, exits, tracking)
        return WorldComponents(self, tuple(frames), arrays, gaussians, entries, ramps, tracking)


@dataclass(frozen=True, eq=False)
class WorldComponents:
    """What the tracker and the reference need, for one set of frames.

    Args:
        local: What they were made of.
        frames: The task frames that it holds for.
        frame_arrays: The same as arrays.
        gaussians: The products of Eq. 9.
        entries: Where the ramp of each component begins [m]. Shape (K, C).
        ramps: The tangent from there to where it ends [m, rad]. Shape (K, T).
        precisions: Its tracking cost, from the residual covariances [1/m^2, 1/rad^2]. Shape (K, T, T).
    """

    local: LocalComponents
    frames: tuple[TaskFrame, ...]
    frame_arrays: FrameArrays
    gaussians: Gaussians
    entries: Array
    ramps: Array
    precisions: Array

    def valid_for(self, frames: Sequence[TaskFrame]) -> bool:
        """Whether these frames are the same."""
        return all(
            a is b or (np.array_equal(a.b, b.b) and np.array_equal(a.A, b.A))
            for a, b in zip(frames, self.frames, strict=True)
        )

    def weights(self, component: int) -> Array:
        """Share of each frame in a component's mean; they sum to the identity. Shape (P, T, T)."""
        precisions = self.local.residual_precisions[:, component]
        if len(self.frames) == 1:
            return np.eye(precisions.shape[-1])[None]
        factors = np.stack([f.covariance_to_world(p) for f, p in zip(self.frames, precisions, strict=True)])
        return np.linalg.solve(factors.sum(axis=0), factors)


@kernel
def _seen(means, precisions, entries, exits, residual_precisions, frames):
    """Means, precisions and part precisions of the products; entries, exits, ramps and their precisions."""
    world_means, world_precisions = product(means, precisions, frames)
    world_entries, tracking = product(entries, residual_precisions, frames)
    world_exits, _ = product(exits, residual_precisions, frames)
    K, T = world_precisions.shape[:2]
    ramps = np.empty((K, T))
    for i in range(K):
        log_at(world_entries[i], world_exits[i], ramps[i])
    parts = world_precisions.copy()
    if means.shape[2] > T:
        room = np.empty((2, T, T))
        for i in range(K):
            invert(world_precisions[i], room[0], room[1])
            separate_parts(room[1], parts[i])
    return world_means, world_precisions, parts, world_entries, world_exits, ramps, tracking


@kernel
def separate_parts(covariance, out):
    """Write the precisions of position and rotation, each by itself, to the diagonal blocks of out."""
    block, L, inverted = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for first in (0, 3):
        for a in range(3):
            for b in range(3):
                block[a, b] = covariance[first + a, first + b]
                out[first + a, 3 - first + b] = 0.0
        invert(block, L, inverted)
        for a in range(3):
            for b in range(3):
                out[first + a, first + b] = inverted[a, b]
