"""A way as bytes: 1.2 kB for a pose.

Points are 16-bit fractions of the largest coordinate, gains and Cholesky factors of covariances are in half
precision. What is rounded moves a motion by a tenth of a millimetre. A way that was read gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.manifold import Manifold
from farhand.common.model.way import N_COARSE, N_PHASES, Way

Array = NDArray[np.float64]
Take = Callable[..., NDArray]

_FULL, _WHOLE = 32767, 65535


def bytes_of(way: Way) -> bytes:
    """Encode a way."""
    space = way.space
    D = space.n_dims
    scale = np.float32(np.abs(way.points[..., :D]).max() / _FULL) or np.float32(1.0)
    places, turns = way.points[..., :D] / float(scale), way.points[..., D:] * _FULL
    return b"".join(
        [
            np.array([way.n_demonstrations, way.terminal], "<u2").tobytes(),
            np.array([way.duration_s, scale], "<f4").tobytes(),
            np.round(np.concatenate([places, turns], axis=-1)).astype("<i2").tobytes(),
            np.round(way.time_shares * _WHOLE).astype("<u2").tobytes(),
            *(_half(way.gains[:, 1:-1, part, part]) for part in space.parts),
            *(
                _half(
                    _triangles(np.asarray(np.linalg.cholesky(way.covariances[..., p, p]), dtype=np.float64))
                )
                for p in space.parts
            ),
            *(
                (_triangles(way.start_covariances[:, p, p]) + 0.0).astype("<f4").tobytes()
                for p in space.parts
            ),
            _half(way.time_gains),
            _half(way.duration_gains),
            _half(way.deviations),
        ]
    )


def way_from(take: Take, n_frames: int, space: Manifold) -> Way:
    """Decode a way.

    Args:
        take: Takes the next array off the bytes, given its type and shape.
        n_frames: P.
        space: Of the points.

    Raises:
        InvalidModel: When the bytes end too early, or describe no way.
    """
    P, C, T, M = n_frames, space.n_coordinates, space.n_tangent, N_COARSE + 1
    n_demonstrations, terminal = (int(number) for number in take("<u2", 2))
    duration_s, scale = (float(number) for number in take("<f4", 2))
    points = take("<i2", P, N_PHASES + 1, C).astype(np.float64)
    points *= np.repeat([scale, 1.0 / _FULL], [space.n_dims, C - space.n_dims])
    time_shares = take("<u2", N_PHASES + 1) / _WHOLE
    gains, covariances, starts = np.zeros((P, M, T, T)), np.zeros((P, M, T, T)), np.zeros((P, T, T))
    gains[:, 0] = np.eye(T)
    sizes = [len(range(T)[part]) for part in space.parts]
    for part, n in zip(space.parts, sizes, strict=True):
        gains[:, 1:-1, part, part] = take("<f2", P, M - 2, n, n)
    for part, n in zip(space.parts, sizes, strict=True):
        L = _lower(take("<f2", P, M, n * (n + 1) // 2), n)
        covariances[..., part, part] = L @ np.swapaxes(L, -1, -2)
    for part, n in zip(space.parts, sizes, strict=True):
        L = _lower(take("<f4", P, n * (n + 1) // 2), n)
        starts[:, part, part] = L + np.swapaxes(np.tril(L, -1), -1, -2)
    return Way(
        n_demonstrations=n_demonstrations,
        terminal=terminal,
        duration_s=duration_s,
        points=points,
        time_shares=time_shares,
        gains=gains,
        covariances=covariances,
        start_covariances=starts,
        time_gains=take("<f2", M, T),
        duration_gains=take("<f2", T),
        deviations=take("<f2", M, len(space.parts)),
    )


def _half(array: Array) -> bytes:
    return (array.astype("<f2") + np.float16(0.0)).tobytes()  # no negative zeros


def _triangles(matrices: Array) -> Array:
    rows, columns = np.tril_indices(matrices.shape[-1])
    return matrices[..., rows, columns]


def _lower(numbers: Array, n: int) -> Array:
    rows, columns = np.tril_indices(n)
    L = np.zeros((*numbers.shape[:-1], n, n))
    L[..., rows, columns] = numbers
    return L
