"""Covariances of a few demonstrations: their parts, and how far they may be trusted where frames are weighed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.manifold import Manifold

Array = NDArray[np.float64]


def symmetric(matrices: Array) -> Array:
    """Return the symmetric parts of matrices."""
    return 0.5 * (matrices + np.swapaxes(matrices, -1, -2))


def apart(covariances: Array, space: Manifold) -> Array:
    """Return covariances with zeros between position and rotation."""
    separate = np.zeros_like(covariances)
    for part in space.parts:
        separate[..., part, part] = covariances[..., part, part]
    return separate


def per_part(space: Manifold, metres: float, radians: float) -> Array:
    """Return one number for each of a tangent's positions and another for each of its rotations. Shape (T,)."""
    numbers = np.full(space.n_tangent, metres)
    numbers[space.n_dims :] = radians
    return numbers


def less_by_chance(covariances: Array, n: Array, space: Manifold) -> Array:
    """Return covariances drawn towards round ones of the same traces, the more the fewer demonstrations they are of.

    Few demonstrations lie on a line by chance, and a frame that has no part in the task then seems to know one
    direction well, so that its say grows where the scene is unlike the demonstrated ones.

    Args:
        covariances: Shape (..., T, T).
        n: Degrees of freedom that they are estimated from. Shape (...).
        space: Of the tangents.
    """
    round_ones = np.zeros_like(covariances)
    for part in space.parts:
        D = len(range(space.n_tangent)[part])
        variances = np.trace(covariances[..., part, part], axis1=-2, axis2=-1) / D
        round_ones[..., part, part] = variances[..., None, None] * np.eye(D)
    share = (space.n_dims / (space.n_dims + n))[..., None, None]
    return (1.0 - share) * covariances + share * round_ones
