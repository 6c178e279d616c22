"""Ways, learned online: whole motions regressed on their starts, with one update per demonstration.

Similar demonstrations share a way (DP-means again, over whole motions), and ways that turn out to be similar are
merged exactly. Covariances estimated from few demonstrations are shrunk before frames are weighed by them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.manifold import Manifold
from farhand.common.model.way import (
    GAIN_STD,
    N_COARSE,
    START_SPREAD,
    START_WEIGHT,
    Way,
    spread_squares,
)
from farhand.local_site.learning.way_statistics import COARSE, WayStatistics, WholeMotion

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
    """Return a vector with one value for a tangent's positions and another for its rotations. Shape (T,)."""
    numbers = np.full(space.n_tangent, metres)
    numbers[space.n_dims :] = radians
    return numbers


def less_by_chance(covariances: Array, n: Array, space: Manifold) -> Array:
    """Shrink covariances towards isotropic ones of the same trace, the more the fewer the degrees of freedom.

    Few demonstrations may lie on a line by chance. A frame that is irrelevant to the task then seems precise in one
    direction, and its weight grows in scenes unlike the demonstrated ones.

    Args:
        covariances: Estimated covariances. Shape (..., T, T).
        n: Degrees of freedom of each estimate. Shape (...).
        space: Space of the tangents.
    """
    round_ones = np.zeros_like(covariances)
    for part in space.parts:
        D = len(range(space.n_tangent)[part])
        variances = np.trace(covariances[..., part, part], axis1=-2, axis2=-1) / D
        round_ones[..., part, part] = variances[..., None, None] * np.eye(D)
    share = (space.n_dims / (space.n_dims + n))[..., None, None]
    return (1.0 - share) * covariances + share * round_ones


# Prior deviation of a motion from its regression on the start [lambda, rad], and the weight of this prior.
_NOISE, _NOISE_WEIGHT = 0.15, 2.0
# If demonstrations agree to within this share of their starts' spread, the motion does not depend on the start.
_CALM = 0.05
# Priors of the regressions of time shares and of the duration: spread of the starts [lambda, rad].
_TIME_SPREAD, _DURATION_SPREAD = 0.7, 1.0


def joined(
    ways: tuple[WayStatistics, ...], motion: WholeMotion, space: Manifold, max_distance_m: float
) -> tuple[WayStatistics, ...]:
    """Return the ways after one more demonstration.

    The demonstration joins the nearest way, or founds a new one; then ways that predict each other are merged.
    """
    new = WayStatistics.of(motion, space)
    distances = [_distance(way, motion.points[-1], space, max_distance_m) for way in ways]
    if not ways or min(distances) > 1.0:
        return (*ways, new)
    nearest = int(np.argmin(distances))
    kept = [*ways]
    kept[nearest] = kept[nearest].merged(new, space)
    return _without_twins(kept, space, max_distance_m)


def _without_twins(ways: list[WayStatistics], space: Manifold, unit: float) -> tuple[WayStatistics, ...]:
    """Return the ways after merging pairs that predict each other's mean."""
    for a, b in combinations(range(len(ways)), 2):
        one, other = ways[a], ways[b]
        apart = [_distance(x, y.points[-1], space, unit) for x, y in ((one, other), (other, one))]
        if max(apart) <= 1.0:
            rest = [way for k, way in enumerate(ways) if k not in (a, b)]
            return _without_twins([one.merged(other, space), *rest], space, unit)
    return tuple(ways)


def _distance(way: WayStatistics, points: Array, space: Manifold, max_distance_m: float) -> float:
    """Return the distance of a motion in the goal's frame (N + 1, C) from a way, given the start [lambda or rad]."""
    regression, worst = Regression.of(way, space, max_distance_m), 0.0
    e = space.log(way.points[-1, 0], points[0])
    expected = space.exp(way.points[-1, COARSE], regression.gains[-1] @ e)
    off = space.log(expected, points[COARSE])
    for number, part in enumerate(space.parts):
        sigma = regression.deviations[-1, :, number]
        unsure = sigma * np.sqrt(spread_squares(way.S[-1, part, part], e[part], sigma))
        unit = max_distance_m if number == 0 else 1.0
        worst = max(worst, float((np.linalg.norm(off[:, part], axis=1) - unsure).max()) / unit)
    return worst


@dataclass(frozen=True, eq=False)
class Regression:
    """Regression of the points on the start, for one way, separately for position and rotation.

    Args:
        gains: Gains at the coarse phases. Shape (P, M + 1, T, T).
        deviations: Standard deviations of the noise, at the coarse phases. Shape (P, M + 1, B).
        spent: Degrees of freedom used by mean and gains. Shape (P, M + 1, B).
    """

    gains: Array
    deviations: Array
    spent: Array

    @classmethod
    def of(cls, way: WayStatistics, space: Manifold, max_distance_m: float) -> Regression:
        """Return the regression of a way's statistics."""
        P, M, T = way.C.shape[:3]
        gains, (deviations, spent) = np.zeros((P, M, T, T)), np.empty((2, P, M, len(space.parts)))
        for p in range(P):
            for number, part in enumerate(space.parts):
                unit = max_distance_m if number == 0 else 1.0
                G, sigma, used = _regressed(
                    way.S[p, part, part], way.C[p, :, part, part], way.V[p, :, part, part], way.n, unit
                )
                gains[p, :, part, part], deviations[p, :, number], spent[p, :, number] = G, sigma, used
        return cls(gains, deviations, spent)


def _regressed(S: Array, C: Array, V: Array, n: int, unit: float) -> tuple[Array, Array, Array]:
    """Return gains (M + 1, D, D), deviations of the noise (M + 1,), and used degrees of freedom (M + 1,).

    The prior gain is a multiple of the identity, that of a linear warp unless the data differ (empirical Bayes);
    the entries deviate from it by `GAIN_STD`. Noise and gains are estimated alternately.
    """
    D = len(S)
    phase = np.linspace(0.0, 1.0, N_COARSE + 1)
    R0 = START_WEIGHT * (START_SPREAD * unit) ** 2
    share = (np.trace(C, axis1=1, axis2=2) + (1.0 - phase) ** 2 * R0 * D) / (np.trace(S) + R0 * D)
    eye, least = np.eye(D), (_NOISE * unit) ** 2
    values, axes = np.linalg.eigh(S)
    values = np.maximum(values, 0.0)
    rest = (C - share[:, None, None] * S) @ axes
    variance, used, G = np.full(len(C), least), np.ones(len(C)), np.empty_like(C)
    for _ in range(4):
        ridge = values + variance[:, None] / GAIN_STD**2
        G = share[:, None, None] * eye + (rest / ridge[:, None, :]) @ axes.T
        left = V - G @ np.swapaxes(C, 1, 2) - C @ np.swapaxes(G, 1, 2) + G @ S @ np.swapaxes(G, 1, 2)
        used = 1.0 + (values / ridge).sum(axis=1)
        missed = np.maximum(np.trace(left, axis1=1, axis2=2), 0.0) / D
        variance = (missed + _NOISE_WEIGHT * least) / (np.maximum(n - used, 0.0) + _NOISE_WEIGHT)
    G[0], G[-1], used[-1] = eye, 0.0, 1.0
    return G, np.sqrt(variance), used


def model_of(way: WayStatistics, space: Manifold, max_distance_m: float, min_covariance: Array) -> Way:
    """Return the model's way: without dependence on the start where demonstrations agree, and with the residuals."""
    regression, n = Regression.of(way, space, max_distance_m), way.n
    gains, left = regression.gains.copy(), np.zeros_like(way.V)
    for part in space.parts:
        S, V = (np.trace(a[..., part, part], axis1=-2, axis2=-1) for a in (way.S, way.V))
        if n > 1:
            agreed = _CALM**2 * S[:, None] / np.maximum(V, 1e-12)
            gains[:, 1:, part, part] *= np.maximum(0.0, 1.0 - agreed)[:, 1:, None, None]
        G, C = gains[..., part, part], way.C[..., part, part]
        Ct = np.swapaxes(C, -1, -2)
        GS = G @ way.S[:, None, part, part] @ np.swapaxes(G, -1, -2)
        left[..., part, part] = way.V[..., part, part] - G @ Ct - C @ np.swapaxes(G, -1, -2) + GS
    if (
        len(way.points) > 1
    ):  # frames are weighed against each other: the precision of none must be overestimated
        free = np.maximum(n - regression.spent.max(axis=-1), 1.0)
        left = less_by_chance(left / free[..., None, None], free, space)
    else:
        left = left / n
    left = symmetric(left)
    S, units = way.S[-1], np.repeat([max_distance_m**2, 1.0], [space.n_dims, space.n_tangent - space.n_dims])
    time_gains, duration_gains = np.zeros_like(way.c), np.zeros_like(way.d)
    for part in space.parts:
        prior = START_WEIGHT * np.diag(units[part])
        time_gains[:, part] = np.linalg.solve(S[part, part] + _TIME_SPREAD**2 * prior, way.c[:, part].T).T
        duration_gains[part] = np.linalg.solve(S[part, part] + _DURATION_SPREAD**2 * prior, way.d[part])
    return Way(
        n_demonstrations=n,
        terminal=int(way.ends[np.argmax(way.ends[:, 1]), 0]),
        duration_s=float(np.exp(way.log_duration)),
        points=way.points,
        time_shares=np.maximum.accumulate(way.time_shares),
        gains=gains,
        covariances=left + min_covariance,
        start_covariances=apart(way.S, space) / n,
        time_gains=time_gains,
        duration_gains=duration_gains,
        deviations=regression.deviations[-1],
    )
