"""State of a learner as one object, and its conversion to the parameters theta of the TP-HSMM (Sec. III-A)."""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.manifold import Manifold
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.model.way import START_SPREAD, START_WEIGHT
from farhand.local_site.learning.clusters import Clusters
from farhand.local_site.learning.dwell_statistics import (
    Dwell,
    Segment,
    duration_variance,
    moving_shares,
    time_shares,
    transition_probabilities,
)
from farhand.local_site.learning.learner_settings import LearnerSettings
from farhand.local_site.learning.motion import Motion
from farhand.local_site.learning.way_regression import apart, less_by_chance, model_of, per_part, symmetric
from farhand.local_site.learning.way_statistics import WayStatistics

Array = NDArray[np.float64]

Arrays = TypeVar("Arrays", bound=tuple[np.ndarray, ...])


class Snapshot(NamedTuple):
    """Complete state of a learner, as copies."""

    clusters: Clusters
    dwell: Dwell
    ways: tuple[WayStatistics, ...]
    motion: Motion | None
    segment: Segment | None

    def arrays(self) -> list[np.ndarray]:
        """Iterate over all arrays."""
        return _arrays(self)


def _arrays(part: tuple | np.ndarray | WayStatistics | None) -> list[np.ndarray]:
    if part is None or isinstance(part, np.ndarray):
        return [] if part is None else [part]
    if isinstance(part, WayStatistics):
        return [np.asarray(value) for value in vars(part).values()]
    return [array for each in part for array in _arrays(each)]


def filled(larger: Arrays, smaller: Arrays) -> Arrays:
    """Copy the arrays of one tuple into the corners of a larger one's."""
    for target, source in zip(larger, smaller, strict=True):
        target[tuple(slice(n) for n in source.shape)] = source
    return larger


# A duration seen once says little about its spread: at least this fraction, and a sample at 50 Hz.
_DURATION_FLOOR = 0.15
_DURATION_FLOOR_S = 0.02
# Elapsed times closer together than this carry no slope.
_ELAPSED_FLOOR_S = 0.01
# A component in which the hand rested nearly all the time is crossed in this part of its duration at least.
_LEAST_MOVING = 0.01
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
    """Return the model that the statistics describe."""
    size, C, T = int(clusters.size[0]), space.n_coordinates, space.n_tangent
    counts, terminal = clusters.counts[:size], clusters.terminal[:size]
    means = clusters.means[:size].swapaxes(0, 1)  # (P, K, Y)
    scatter = clusters.scatters[:size].swapaxes(0, 1) / counts[:, None, None]
    x, s = slice(0, T), slice(T, 2 * T)

    min_covariance = np.diag(per_part(space, settings.min_std, settings.min_std_rad) ** 2)
    phase = dwell.phase_sum[:size] / np.maximum(dwell.phase_count[:size], 1)
    n_demonstrations = int(dwell.ends.sum())
    units = np.diag(per_part(space, settings.max_distance_m, 1.0) ** 2)  # a lambda, a radian
    weight = START_WEIGHT / max(n_demonstrations, 1)
    prior, timing_prior = weight * START_SPREAD**2 * units, weight * _TIMING_SPREAD**2 * units
    start_covariances = apart(symmetric(scatter[..., s, s]) + prior, space)
    slopes, residuals = _ramps(scatter, T, timing_prior)
    moving = np.maximum(moving_shares(dwell, size), _LEAST_MOVING)
    transition, exit_probability = transition_probabilities(dwell, size)
    covariances = symmetric(scatter[..., x, x])
    if len(frame_names) > 1:
        visits = np.where(terminal, counts, dwell.visits[:size])
        covariances, residuals = (less_by_chance(each, visits, space) for each in (covariances, residuals))
    return TPHSMM(
        frame_names=frame_names,
        max_distance_m=settings.max_distance_m,
        n_demonstrations=n_demonstrations,
        initial=dwell.starts[:size] / max(int(dwell.starts.sum()), 1),
        transition=transition,
        time_share=time_shares(dwell, size),
        exit=exit_probability,
        means=means[..., :C],
        covariances=covariances + min_covariance,
        duration_mean_s=dwell.mean[:size],
        duration_variance_s2=duration_variance(dwell, size, _DURATION_FLOOR, _DURATION_FLOOR_S),
        terminal=terminal,
        counts=counts,
        phase=phase,
        elapsed_mean_s=means[0, :, 2 * C] / moving,
        slopes=slopes * moving[:, None],
        residual_covariances=residuals + min_covariance,
        start_means=means[..., C : 2 * C],
        start_covariances=start_covariances,
        ways=tuple(model_of(way, space, settings.max_distance_m, min_covariance) for way in ways),
    )


def _ramps(scatter: Array, T: int, prior: Array) -> tuple[Array, Array]:
    """Return the regression of the point on the elapsed time, and the residual covariance.

    Demonstrations from elsewhere enter a component at another place and stay for another time. Therefore the
    ramp is the slope among motions of one start: that of the regression on elapsed time and start.
    """
    y, s = [*range(T), 2 * T], slice(T, 2 * T)  # point and elapsed time, start
    C_sy = scatter[..., s, y]
    by_start = np.linalg.solve(scatter[..., s, s] + prior, C_sy)
    own = scatter[..., y, :][..., y] - np.swapaxes(C_sy, -1, -2) @ by_start
    slopes = own[..., :T, T] / (own[..., T, T] + _ELAPSED_FLOOR_S**2)[..., None]
    time_x = scatter[..., 2 * T, :T]
    along = slopes[..., :, None] * time_x[..., None, :]
    square = slopes[..., :, None] * slopes[..., None, :] * scatter[..., 2 * T, 2 * T, None, None]
    left = scatter[..., :T, :T] - along - np.swapaxes(along, -1, -2) + square
    return slopes, symmetric(left)
