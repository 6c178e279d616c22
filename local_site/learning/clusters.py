"""Clusters: the sufficient statistics of the components, in the count form of Algorithm 1.

A component's mean is the running mean of its datapoints, its covariance the minimum covariance plus their
scatter divided by their number. Each datapoint carries more than its point x, and the same update serves
the whole vector

    y = [ x, s, elapsed, w_u lambda u, w_sigma sigma ]        per frame

with s the start of the demonstration, *elapsed* the time since the component was entered, u the unit
direction of travel and sigma the distance travelled since the start. x and s are points, of C coordinates,
whose differences are tangents, of T numbers (see `farhand.common.model.manifold`): a mean has 2 C + T + 2 numbers. The
scatter is that of x, s and elapsed, 2 T + 1 rows in the axes of the mean; u and sigma serve the assignment
alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.kernel import kernel, plain_kernel
from farhand.common.model.manifold import Manifold, copy_to, exp_at, log_at

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Clusters(NamedTuple):
    """Sufficient statistics of the components; arrays have room for more than `size` of them."""

    size: Integers  # K, shape (1,)
    counts: Integers  # n_i, shape (capacity,)
    terminal: NDArray[np.bool_]  # shape (capacity,)
    shares: Array  # of the frames in the assignment, shape (capacity, P)
    means: Array  # of y, shape (capacity, P, 2 C + T + 2)
    scatters: Array  # of x, s, elapsed about their mean, shape (capacity, P, 2 T + 1, 2 T + 1)
    places: Array  # positions of the means side by side, for the search; shape (P, D, capacity)

    @classmethod
    def empty(cls, capacity: int, n_frames: int, space: Manifold) -> Clusters:
        """Return statistics without a component."""
        rows = 2 * space.n_tangent + 1
        return cls(
            np.zeros(1, np.int64),
            np.zeros(capacity, np.int64),
            np.zeros(capacity, np.bool_),
            np.zeros((capacity, n_frames)),
            np.zeros((capacity, n_frames, 2 * space.n_coordinates + space.n_tangent + 2)),
            np.zeros((capacity, n_frames, rows, rows)),
            np.zeros((n_frames, space.n_dims, capacity)),
        )


@kernel
def new_component(clusters):
    """Return the index of a component that has no datapoint yet."""
    k = clusters.size[0]
    clusters.size[0] = k + 1
    return k


@plain_kernel
def update(clusters, q, y, C, T, e):
    """Running mean and scatter: n += 1, S += (n-1)/n e e^T, mu <- exp(mu, e/n), with e = log(mu, y)."""
    _join(clusters, q, y, C, T, e)
    for p in range(y.shape[0]):
        for k in range(clusters.places.shape[1]):
            clusters.places[p, k, q] = clusters.means[q, p, k]


@plain_kernel
def _join(clusters, q, y, C, T, e):
    clusters.counts[q] += 1
    n = clusters.counts[q]
    if n == 1:
        for p in range(y.shape[0]):
            copy_to(y[p], clusters.means[q, p])
        return
    step, share = 1.0 / n, (n - 1) / n
    for p in range(y.shape[0]):
        mean, scatter = clusters.means[q, p], clusters.scatters[q, p]
        log_at(mean[:C], y[p, :C], e[:T])
        log_at(mean[C : 2 * C], y[p, C : 2 * C], e[T : 2 * T])
        e[2 * T] = y[p, 2 * C] - mean[2 * C]
        for k in range(e.size):
            for m in range(e.size):
                scatter[k, m] += share * (e[k] * e[m])
        for k in range(e.size):
            e[k] *= step
        if C > T:
            _turn_axes(scatter, T - 3, e)
            _turn_axes(scatter, 2 * T - 3, e)
        exp_at(mean[:C], e[:T], mean[:C])
        exp_at(mean[C : 2 * C], e[T : 2 * T], mean[C : 2 * C])
        for k in range(2 * C, mean.size):
            mean[k] += step * (y[p, k] - mean[k])


@plain_kernel
def _turn_axes(scatter, first, step):
    """Carry the three rows and columns of a rotation along when its mean is rotated by a step.

    Seen from the new mean, small differences are rotated back by half the step (parallel transport).
    """
    x, y, z = 0.5 * step[first], 0.5 * step[first + 1], 0.5 * step[first + 2]
    square = x * x + y * y + z * z
    for k in range(scatter.shape[0]):
        _turn_back(scatter, first, k, 1, 0, x, y, z, square)
    for k in range(scatter.shape[0]):
        _turn_back(scatter, k, first, 0, 1, x, y, z, square)


@plain_kernel
def _turn_back(S, row, column, down, right, x, y, z, square):
    """Rotate v, three numbers of S, by -h to second order: v - h x v + h x (h x v) / 2, h = (x, y, z)."""
    a, b, c = S[row, column], S[row + down, column + right], S[row + 2 * down, column + 2 * right]
    along, keep = 0.5 * (x * a + y * b + z * c), 1.0 - 0.5 * square
    S[row, column] = keep * a - (y * c - z * b) + along * x
    S[row + down, column + right] = keep * b - (z * a - x * c) + along * y
    S[row + 2 * down, column + 2 * right] = keep * c - (x * b - y * a) + along * z
