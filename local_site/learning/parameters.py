"""From sufficient statistics to the parameters theta of the TP-HSMM (Sec. III-A)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.manifold import Manifold
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.model.ways import START_SPREAD, START_WEIGHT
from farhand.local_site.learning.clusters import Clusters
from farhand.local_site.learning.dwell_statistics import (
    Dwell,
    duration_variance,
    time_shares,
    transition_probabilities,
)
from farhand.local_site.learning.learner_settings import LearnerSettings
from farhand.local_site.learning.way_statistics import WayStatistics
from farhand.local_site.learning.ways import model_of

Array = NDArray[np.float64]

# A duration seen once says little about its spread: at least this fraction, and a sample at 50 Hz.
_DURATION_FLOOR = 0.15
_DURATION_FLOOR_S = 0.02
# Elapsed times closer together than this carry no slope.
_ELAPSED_FLOOR_S = 0.01
# How far starts spread where few were shown, and for the regression of the time [lambda, rad].
_TIMING_SPREAD = 1.0


def parameters(
    clusters: Clusters,
    dwell: Dwell,
    ways: tuple[WayStatistics, ...],
    settings: LearnerSettings,
    frame_names: tuple[str, ...],
    space: Manifold,
) -> TPHSMM:
    """The model that the statistics describe."""
    size, C, T = int(clusters.size[0]), space.n_coordinates, space.n_tangent
    counts, terminal = clusters.counts[:size], clusters.terminal[:size]
    means = clusters.means[:size].swapaxes(0, 1)  # (P, K, Y)
    scatter = clusters.scatters[:size].swapaxes(0, 1) / counts[:, None, None]
    x, s = slice(0, T), slice(T, 2 * T)

    min_covariance = np.diag(_per_part(space, settings.min_std, settings.min_std_rad) ** 2)
    phase = dwell.phase_sum[:size] / np.maximum(dwell.phase_count[:size], 1)
    n_demonstrations = int(dwell.ends.sum())
    units = np.diag(_per_part(space, settings.max_distance_m, 1.0) ** 2)  # a lambda, a radian
    weight = START_WEIGHT / max(n_demonstrations, 1)
    prior, timing_prior = weight * START_SPREAD**2 * units, weight * _TIMING_SPREAD**2 * units
    start_covariances = _apart(_symmetric(scatter[..., s, s]) + prior, space.parts)
    slopes, residuals = _ramps(scatter, T, timing_prior)
    transition, exit_probability = transition_probabilities(dwell, size)
    return TPHSMM(
        frame_names=frame_names,
        max_distance_m=settings.max_distance_m,
        n_demonstrations=n_demonstrations,
        initial=dwell.starts[:size] / max(int(dwell.starts.sum()), 1),
        transition=transition,
        time_share=time_shares(dwell, size),
        exit=exit_probability,
        means=means[..., :C],
        covariances=_symmetric(scatter[..., x, x]) + min_covariance,
        duration_mean_s=dwell.mean[:size],
        duration_variance_s2=duration_variance(dwell, size, _DURATION_FLOOR, _DURATION_FLOOR_S),
        terminal=terminal,
        counts=counts,
        phase=phase,
        elapsed_mean_s=means[0, :, 2 * C],
        slopes=slopes,
        residual_covariances=_symmetric(residuals) + min_covariance,
        start_means=means[..., C : 2 * C],
        start_covariances=start_covariances,
        ways=tuple(model_of(way, space, settings.max_distance_m, min_covariance) for way in ways),
    )


def _ramps(scatter: Array, T: int, prior: Array) -> tuple[Array, Array]:
    """Regression of the point on the elapsed time, and the covariance that is left.

    Demonstrations from elsewhere enter a component at another place and stay for another time. Therefore
    the ramp is the slope among motions of one start: that of the regression on elapsed time and start.
    """
    y, s = [*range(T), 2 * T], slice(T, 2 * T)  # point and elapsed time, start
    C_sy = scatter[..., s, y]
    by_start = np.linalg.solve(scatter[..., s, s] + prior, C_sy)
    own = scatter[..., y, :][..., y] - np.swapaxes(C_sy, -1, -2) @ by_start
    slopes = own[..., :T, T] / (own[..., T, T] + _ELAPSED_FLOOR_S**2)[..., None]
    left = own[..., :T, :T] - slopes[..., :, None] * own[..., None, :T, T]
    return slopes, left


def _apart(covariances: Array, parts: tuple[slice, ...]) -> Array:
    """The same with zeros between the parts."""
    apart = np.zeros_like(covariances)
    for part in parts:
        apart[..., part, part] = covariances[..., part, part]
    return apart


def _per_part(space: Manifold, metres: float, radians: float) -> Array:
    """One number for each of the tangent's positions and one for each of its rotations. Shape (T,)."""
    numbers = np.full(space.n_tangent, metres)
    numbers[space.n_dims :] = radians
    return numbers


def _symmetric(matrices: Array) -> Array:
    return 0.5 * (matrices + np.swapaxes(matrices, -1, -2))
