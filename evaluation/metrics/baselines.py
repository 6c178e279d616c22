"""Peers to compare with: the warped mean, a regression on the start, a straight line, and ProMP.

ProMP is that of movement_primitives, fitted in batch, conditioned on start and goal (Sec. VI-A).

The paper's setting is 15 basis functions, demonstrations aligned by dynamic time warping and a regularisation
of 1e-3 of the weights' covariance. Since that is the setting of one task, a small grid beside it is tried in
good faith, and a study that says "ProMP" means the better of the two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from movement_primitives.promp import ProMP
from numpy.typing import NDArray

from farhand.evaluation.metrics.motion_metrics import at_phases, warping_path

Array = NDArray[np.float64]

_N_PHASES = 100
_RIDGE = 1e-6


@dataclass(frozen=True)
class PrompSettings:
    """Settings of a ProMP's fit.

    Args:
        n_weights: Number of basis functions per dimension.
        regularisation: Added to the diagonal of the weights' covariance, in units of the data's extent squared.
        align: Whether demonstrations are aligned by dynamic time warping.
    """

    n_weights: int = 15
    regularisation: float = 1e-3
    align: bool = True


PAPER = PrompSettings()
GRID = tuple(PrompSettings(*one) for one in product((10, 15, 25), (1e-2, 1e-3, 1e-5), (True, False)))


class PrompBaseline:
    """ProMP with a mean and covariance of its weights.

    Args:
        n_dims: Dimension D.
        n_weights: Number of basis functions per dimension.
        mean: Shape (D * n_weights,).
        covariance: Shape (D * n_weights, D * n_weights).
    """

    def __init__(self, n_dims: int, n_weights: int, mean: Array, covariance: Array):
        self._promp = ProMP(n_dims, n_weights)
        self._promp.from_weight_distribution(mean, covariance)

    @classmethod
    def fit(
        cls, times: Sequence[Array], motions: Sequence[Array], settings: PrompSettings = PAPER
    ) -> PrompBaseline:
        """Fit a ProMP to some motions.

        Args:
            times: Times of each motion [s]. Shapes (T,).
            motions: Positions, all in one frame [m]. Shapes (T, D).
            settings: Settings of the fit.
        """
        return cls.fit_all(times, motions, (settings,))[0]

    @classmethod
    def fit_all(
        cls, times: Sequence[Array], motions: Sequence[Array], settings: Sequence[PrompSettings] = GRID
    ) -> list[PrompBaseline]:
        """Fit a ProMP to the same motions with each of the settings."""
        n_dims, extent = motions[0].shape[1], float(np.ptp(np.concatenate(motions), axis=0).max())
        plain = [at_phases(t, p, _N_PHASES) for t, p in zip(times, motions, strict=True)]
        aligned = [_aligned(one, plain[0]) for one in plain]
        weights: dict[tuple[int, bool], Array] = {}
        found = []
        for s in settings:
            key = (s.n_weights, s.align)
            if key not in weights:
                weights[key] = _weights(aligned if s.align else plain, s.n_weights)
            spread = np.atleast_2d(np.cov(weights[key], rowvar=False, ddof=1 if len(plain) > 1 else 0))
            ridge = s.regularisation * extent**2 * np.eye(len(spread))
            found.append(cls(n_dims, s.n_weights, weights[key].mean(axis=0), spread + ridge))
        return found

    def motion(self, *conditions: tuple[float, Array], n_points: int = _N_PHASES) -> Array:
        """Compute the mean motion conditioned on points at phases from 0 to 1. Shape (n_points, D) [m]."""
        promp = self._promp
        for phase, point in conditions:
            promp = promp.condition_position(point, 1e-10 * np.eye(promp.n_dims), t=phase)  # pyright: ignore[reportArgumentType]
        return promp.mean_trajectory(np.linspace(0.0, 1.0, n_points))


def _weights(motions: Sequence[Array], n_weights: int) -> Array:
    """Return the weights of each motion. Shape (N, D * n_weights)."""
    phase, promp = np.linspace(0.0, 1.0, _N_PHASES), ProMP(motions[0].shape[1], n_weights)
    return np.stack([promp.weights(phase, one, _RIDGE) for one in motions])


def _aligned(motion: Array, reference: Array) -> Array:
    """Resample the motion at the phases that dynamic time warping aligns with the reference. Shape (N, D)."""
    ours, theirs = warping_path(motion, reference)
    total = np.zeros_like(reference)
    np.add.at(total, theirs, motion[ours])
    return total / np.bincount(theirs, minlength=len(reference))[:, None]


def mean_warp(motions: Sequence[Array], start: Array, goal: Array) -> Array:
    """Compute the mean motion, moved linearly to the given start and end.

    Args:
        motions: Demonstrations at the same phases, in one frame [m]. Shapes (N, D).
        start: Start [m]. Shape (D,).
        goal: End [m]. Shape (D,).
    """
    mean = np.mean(motions, axis=0)
    to_go = np.linspace(1.0, 0.0, len(mean))[:, None]
    return mean + to_go * (start - mean[0]) + (1.0 - to_go) * (goal - mean[-1])


def regression_on_start(motions: Sequence[Array], start: Array) -> Array:
    """Return the motion that an ordinary least-squares regression of whole motions on their starts predicts.

    Neither weights nor phases are restricted, so this is as near as any regression linear in the start comes to
    the demonstrations themselves.

    Args:
        motions: Demonstrations at the same phases, in one frame [m]. Shapes (N, D).
        start: Start [m]. Shape (D,).
    """
    shown = np.asarray(motions)
    starts = np.column_stack([np.ones(len(shown)), shown[:, 0] - shown[:, 0].mean(axis=0)])
    gains = np.linalg.lstsq(starts, shown.reshape(len(shown), -1), rcond=None)[0]
    motion = np.concatenate([[1.0], start - shown[:, 0].mean(axis=0)]) @ gains
    return np.asarray(motion, dtype=np.float64).reshape(shown.shape[1:])


def straight_line(start: Array, goal: Array, n_points: int = 100) -> Array:
    """Return a straight motion from start to goal with a hand's timing. Shape (n_points, D) [m]."""
    tau = np.linspace(0.0, 1.0, n_points)[:, None]
    return start + tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2) * (goal - start)
