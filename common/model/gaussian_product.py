"""Product of a component's Gaussians over the task frames (Eqs. 8 and 9).

The mean is where the product of the densities is largest, found by Gauss-Newton steps from the first frame's
mean; for positions the first step is the closed form of Eq. 9. If frames disagree about an orientation by
nearly half a turn, that maximum is the one nearest to the first frame's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput
from farhand.common.model.kernel import kernel
from farhand.common.model.manifold import Manifold, exp_at, inverse_right_jacobian, log_at
from farhand.common.model.small_matrix import invert, transform
from farhand.common.model.task_frame import FrameArrays, TaskFrame, matrix_to_world, point_to_world

Array = NDArray[np.float64]

_MAX_STEPS = 20
_CONVERGED = 1e-10
# A frame is idle below both of these shares: of the whole motion, and of any component.
_IDLE_MEAN, _IDLE_MOST = 0.15, 0.95


def gaussian_product(means: Array, covariances: Array, frames: Sequence[TaskFrame]) -> tuple[Array, Array]:
    """Return the Gaussians of all components in the world, given the present task frames.

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
    world, precisions = product(means, inverse(covariances), FrameArrays.of(frames, space.oriented))
    return world, inverse(precisions)


def check_frames(frames: Sequence[TaskFrame], n_frames: int, n_dims: int) -> None:
    """Refuse frames that do not fit a model of P frames in D dimensions."""
    if len(frames) != n_frames:
        raise InvalidInput("task frames", "", f"{n_frames} frames, as the model has, got {len(frames)}")
    for index, frame in enumerate(frames):
        if frame.n_dims != n_dims:
            raise InvalidInput("task frames", f"frame {index}", f"dimension {n_dims}, got {frame.n_dims}")


def frame_shares(covariances: Array) -> Array:
    """Return the share of each frame in the product of each component: of the trace of its precision, per part.

    Of the two parts of a pose the larger share counts.

    Args:
        covariances: Sigma_i^(j) in each frame. Shape (P, K, T, T).

    Returns:
        Shares, which sum to one over the frames for positions. Shape (P, K).
    """
    n, shares = covariances.shape[-1], []
    for part in (slice(0, min(n, 3)), slice(3, n)):
        if len(range(n)[part]) > 0:
            precise = np.trace(inverse(covariances[..., part, part]), axis1=-2, axis2=-1)
            shares.append(precise / precise.sum(axis=0))
    return np.max(shares, axis=0)


def idle_frames(shares: Array, counts: NDArray[np.int64]) -> list[int]:
    """Return the frames that have no say in a task: a small share in the whole motion, and no component of their own.

    In a component that one demonstration visited alone all frames are equally narrow, so that an idle frame's share
    is not small everywhere.

    Args:
        shares: Of each frame in each component, from the residual covariances. Shape (P, K).
        counts: Datapoints of the components. Shape (K,).
    """
    mean = shares @ counts / counts.sum()
    return np.flatnonzero((mean < _IDLE_MEAN) & (shares.max(axis=1) < _IDLE_MOST)).tolist()


def inverse(matrices: Array) -> Array:
    """Return the inverses of the matrices in the last two axes. Shape (..., T, T)."""
    return np.asarray(np.linalg.inv(matrices), dtype=np.float64)


@kernel
def product(means, precisions, frames):
    """Return means and precisions of the products from those in the frames.

    Args:
        means: Shape (P, K, C).
        precisions: Inverse covariances. Shape (P, K, T, T).
        frames: The `FrameArrays`.

    Returns:
        World means (K, C) and precisions (K, T, T).
    """
    P, K, C = means.shape
    T = precisions.shape[2]
    none = np.zeros(4)
    world, factors = np.empty((P, C)), np.empty((P, T, T))
    x, H = np.empty((K, C)), np.zeros((K, T, T))
    room = np.empty((2, T, T))
    for i in range(K):
        for j in range(P):  # Eq. 8
            quat = frames.quat_wxyz[j] if C > T else none
            point_to_world(frames.A[j], frames.b[j], quat, means[j, i], world[j])
            matrix_to_world(frames.A[j], precisions[j, i], factors[j], room[0])
        x[i] = world[0]
        H[i] = factors[0]
        steps = _MAX_STEPS if C > T else 1
        while P > 1 and steps > 0:
            steps = steps - 1 if _step(world, factors, x[i], H[i], room) > _CONVERGED else 0
    return x, H


@kernel
def _step(world, factors, x, H, room):
    """Take one Gauss-Newton step of x towards the product (Eq. 9 in the tangent space of x).

    Return its length.

    The error in frame j is e_j = log(mu_j, x), and log(mu_j, exp(x, t)) = e_j + J(e_j)^-1 t.
    """
    P, C = world.shape
    T = H.shape[0]
    e, g, t = np.empty(T), np.zeros(T), np.empty(T)
    J, weighted = np.empty((3, 3)), np.empty(T)
    H[:] = 0.0
    for j in range(P):
        log_at(world[j], x, e)
        for a in range(T):
            weighted[a] = 0.0
            for b in range(T):
                weighted[a] += factors[j, a, b] * e[b]
        room[0] = factors[j]
        if C > T:
            inverse_right_jacobian(e[T - 3 :], J)
            transform(room[0], J, room[1])
            turned = weighted[T - 3 :].copy()
            for a in range(3):
                weighted[T - 3 + a] = J[0, a] * turned[0] + J[1, a] * turned[1] + J[2, a] * turned[2]
        for a in range(T):
            g[a] += weighted[a]
            for b in range(T):
                H[a, b] += room[0, a, b]
    invert(H, room[0], room[1])
    length = 0.0
    for a in range(T):
        t[a] = 0.0
        for b in range(T):
            t[a] -= room[1, a, b] * g[b]
        length = max(length, abs(t[a]))
    exp_at(x, t, x)
    return length
