"""The parameters of a TP-HSMM as bytes, part by part.

All is in single precision but for the ways (see `farhand.common.model.way_parts`) and the covariances of the starts,
Cholesky factors in half precision, so that they stay positive definite.
What follows from other numbers is not written: the upper half of symmetric matrices, the transitions that
never happened, and the last probability of a row that sums to one. A model that was read gives the same
bytes again.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidModel
from farhand.common.model.manifold import Manifold
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.model.way import Way
from farhand.common.model.way_parts import bytes_of, way_from

Array = NDArray[np.float64]

PARTS = ("priors", "means", "covariances", "transitions", "durations", "extensions", "ways")


def pack(model: TPHSMM) -> dict[str, bytes]:
    """Encode each part of a model as bytes."""
    space = model.manifold
    return {
        "priors": _of_rows(model.initial[None]) + model.terminal.tobytes() + _bytes(model.counts, "<u4"),
        "means": _bytes(model.means),
        "covariances": _of_symmetric(model.covariances),
        "transitions": _of_rows(np.column_stack([model.transition, model.exit])),
        "durations": _bytes(model.duration_mean_s) + _bytes(model.duration_variance_s2),
        "extensions": b"".join(
            [
                _bytes(model.phase) + _bytes(model.elapsed_mean_s),
                _bytes(model.time_share[model.transition > 0]),
                _bytes(model.slopes) + _bytes(model.start_means),
                _of_symmetric(model.residual_covariances),
                *(_of_factors(model.start_covariances[..., part, part]) for part in space.parts),
            ]
        ),
        "ways": b"".join(bytes_of(way) for way in model.ways),
    }


def unpack(
    parts: dict[str, bytes], P: int, K: int, space: Manifold, source: str
) -> tuple[dict[str, NDArray], tuple[Way, ...]]:
    """Decode the arrays of a model of P frames and K components.

    Raises:
        InvalidModel: When a part is longer or shorter than such a model's, or its transitions are malformed.
    """
    C, T = space.n_coordinates, space.n_tangent
    part = {name: _Reader(source, name, parts[name]) for name in PARTS}
    initial = part["priors"].rows(1, K)[0]
    terminal = part["priors"].take("|b1", K)
    rows, extra = part["transitions"].rows(K, K + 1), part["extensions"]
    phase, elapsed_mean_s = extra.take("<f4", 2, K)
    transition, time_share = rows[:, :K], np.zeros((K, K))
    time_share[transition > 0] = extra.take("<f4", int((transition > 0).sum()))
    slopes, start_means = extra.take("<f4", P, K, T), extra.take("<f4", P, K, C)
    residual_covariances, start_covariances = extra.symmetric(P, K, T), np.zeros((P, K, T, T))
    for block in space.parts:
        start_covariances[..., block, block] = extra.factored(P, K, len(range(T)[block]))
    arrays: dict[str, NDArray] = {
        "initial": initial,
        "terminal": terminal,
        "counts": part["priors"].take("<u4", K).astype(np.int64),
        "means": part["means"].take("<f4", P, K, C),
        "covariances": part["covariances"].symmetric(P, K, T),
        "transition": transition,
        "time_share": time_share,
        "exit": rows[:, K],
        "duration_mean_s": part["durations"].take("<f4", K),
        "duration_variance_s2": part["durations"].take("<f4", K),
        "phase": phase,
        "elapsed_mean_s": elapsed_mean_s,
        "slopes": slopes,
        "residual_covariances": residual_covariances,
        "start_means": start_means,
        "start_covariances": start_covariances,
    }
    ways = []
    while not part["ways"].at_end:
        ways.append(way_from(part["ways"].take, P, space))
    for reader in part.values():
        reader.end()
    return arrays, tuple(ways)


def _bytes(array: NDArray, dtype: str = "<f4") -> bytes:
    rounded = array.astype(dtype)
    return (rounded + rounded.dtype.type(0)).tobytes()  # no negative zeros, which a Cholesky factor may have


def _of_symmetric(matrices: NDArray, dtype: str = "<f4") -> bytes:
    """Encode the lower triangles of symmetric matrices."""
    rows, columns = np.tril_indices(matrices.shape[-1])
    return _bytes(matrices[..., rows, columns], dtype)


def _of_factors(covariances: Array) -> bytes:
    """Encode Cholesky factors in half precision."""
    return _of_symmetric(np.linalg.cholesky(covariances), "<f2")


def _of_rows(rows: Array) -> bytes:
    """Encode rows that sum to one: how many entries each, their columns, and all but the last of each row."""
    columns = [np.flatnonzero(row) for row in rows]
    values = [row[mine[:-1]] for row, mine in zip(rows, columns, strict=True)]
    counts = np.array([mine.size for mine in columns])
    return (
        _bytes(counts, "<u2") + _bytes(np.concatenate(columns), "<u2") + _bytes(np.concatenate(values), "<f4")
    )


class _Reader:
    """Reader of arrays from the bytes of one part."""

    def __init__(self, source: str, name: str, data: bytes):
        self._source, self._name, self._data, self._at = source, name, data, 0

    def take(self, dtype: str, *shape: int) -> NDArray:
        """Read the next array."""
        end = self._at + math.prod(shape) * np.dtype(dtype).itemsize
        if end > len(self._data):
            raise self._wrong(f"{end} bytes or more for such a model, got {len(self._data)}")
        piece, self._at = self._data[self._at : end], end
        if dtype == "|b1" and not set(piece) <= {0, 1}:
            raise self._wrong("truth values")
        array = np.frombuffer(piece, dtype=dtype).reshape(shape)
        return array.astype(np.float64) if dtype in ("<f4", "<f2") else array

    def symmetric(self, *shape: int) -> Array:
        """Read symmetric matrices of shape (P, K, n, n), given as P, K, n."""
        *outer, n = shape
        rows, columns = np.tril_indices(n)
        matrices, lower = np.empty((*outer, n, n)), self.take("<f4", *outer, rows.size)
        matrices[..., rows, columns] = matrices[..., columns, rows] = lower
        return matrices

    def factored(self, *shape: int) -> Array:
        """Read covariances of shape (P, K, n, n), given as P, K, n."""
        *outer, n = shape
        rows, columns = np.tril_indices(n)
        L = np.zeros((*outer, n, n))
        L[..., rows, columns] = self.take("<f2", *outer, rows.size)
        return L @ np.swapaxes(L, -1, -2)

    def rows(self, n_rows: int, n_columns: int) -> Array:
        """Read rows that sum to one; the last entry of each is the remainder."""
        counts = self.take("<u2", n_rows).astype(int)
        columns = self.take("<u2", int(counts.sum())).astype(int)
        if (counts == 0).any() or (columns >= n_columns).any():
            raise self._wrong(f"at least one entry in every row, in columns below {n_columns}")
        values = self.take("<f4", int(counts.sum()) - n_rows)
        rows, ends = np.zeros((n_rows, n_columns)), np.cumsum(counts)
        for r, (end, count) in enumerate(zip(ends.tolist(), counts.tolist(), strict=True)):
            *others, last = columns[end - count : end].tolist()
            rows[r, others] = values[end - count - r : end - r - 1]
            rows[r, last] += 1.0 - rows[r].sum()
        return rows

    @property
    def at_end(self) -> bool:
        """True once everything was read."""
        return self._at == len(self._data)

    def end(self) -> None:
        """Check that nothing is left."""
        if self._at < len(self._data):
            raise self._wrong(f"{self._at} bytes for such a model, got {len(self._data)}")

    def _wrong(self, expected: str) -> InvalidModel:
        return InvalidModel(self._source, self._name, expected)
