"""Components of a model in the world, by the present task frames."""

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
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LocalComponents:
    """Frame-independent part: everything in the frames' own coordinates.

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
        """Return the components of a model."""
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

    def seen(self, frames: Sequence[TaskFrame], components: Integers | None = None) -> WorldComponents:
        """Return the components for the present frames. Length P.

        Args:
            frames: The present task frames. Length P.
            components: Which are needed now; all when not given.
        """
        _, K, C = self.means.shape
        T = self.precisions.shape[2]
        means, entries, exits = np.empty((3, K, C))
        precisions, parts, tracking = np.empty((3, K, T, T))
        seen, ramps = np.zeros(K, np.bool_), np.empty((K, T))
        arrays = FrameArrays.of(frames, self.space.oriented)

        def see(which: Integers | None) -> None:
            _see(
                np.arange(K) if which is None else which,
                seen,
                (self.means, self.precisions, self.entries, self.exits, self.residual_precisions),
                arrays,
                (means, precisions, parts, entries, exits, ramps, tracking),
            )

        see(components)
        gaussians = Gaussians(self.space, means, precisions, parts, entries, exits, tracking, see)
        return WorldComponents(self, tuple(frames), arrays, gaussians, entries, ramps, tracking)


@dataclass(frozen=True, eq=False)
class WorldComponents:
    """Inputs of the tracker and the reference, for one set of frames.

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
        """Decide whether these frames are the same."""
        return all(
            a is b or (np.array_equal(a.b, b.b) and np.array_equal(a.A, b.A))
            for a, b in zip(frames, self.frames, strict=True)
        )

    def weights(self, component: int) -> Array:
        """Return the share of each frame in a component's mean; they sum to the identity. Shape (P, T, T)."""
        precisions = self.local.residual_precisions[:, component]
        if len(self.frames) == 1:
            return np.eye(precisions.shape[-1])[None]
        factors = np.stack([f.covariance_to_world(p) for f, p in zip(self.frames, precisions, strict=True)])
        return np.linalg.solve(factors.sum(axis=0), factors)


@kernel
def _see(which, seen, local, frames, world):
    """Put the components that were not seen yet into the world.

    Args:
        which: Their numbers. Shape (n,).
        seen: Which were seen, changed in place. Shape (K,).
        local: The arrays of `LocalComponents`.
        frames: The `FrameArrays`.
        world: Written: means, precisions and part precisions of the products; entries, exits, ramps and their precisions.
    """
    n = 0
    for i in which:
        n += not seen[i]
    new = np.empty(n, np.int64)
    n = 0
    for i in which:
        if not seen[i]:
            seen[i] = True
            new[n] = i
            n += 1
    if n == 0:
        return
    means, precisions, entries, exits, residual_precisions = local
    own_means, own_precisions = product(means[:, new], precisions[:, new], frames)
    tracking = residual_precisions[:, new]
    own_entries, own_tracking = product(entries[:, new], tracking, frames)
    own_exits, _ = product(exits[:, new], tracking, frames)
    T = own_precisions.shape[2]
    room = np.empty((2, T, T))
    for k in range(n):
        i = new[k]
        world[0][i] = own_means[k]
        world[1][i] = own_precisions[k]
        world[2][i] = own_precisions[k]
        world[3][i] = own_entries[k]
        world[4][i] = own_exits[k]
        log_at(own_entries[k], own_exits[k], world[5][i])
        world[6][i] = own_tracking[k]
        if means.shape[2] > T:
            invert(own_precisions[k], room[0], room[1])
            separate_parts(room[1], world[2][i])


@kernel
def separate_parts(covariance, out):
    """Write the separate precisions of position and rotation to the diagonal blocks of out."""
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
