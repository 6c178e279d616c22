"""Filter for a target that mostly stands still, sometimes moves, and may jump: two filters in parallel.

The *quiet* filter expects a target that hardly moves: it averages the noise away, but lags behind a moving
target. The *agile* one follows. The innovations of the quiet filter decide which of the two applies: noise
averages out of them, a lag does not. The innovations of the agile filter decide whether the target jumped,
since in any sway the quiet filter's are large.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.manifold import POSE, Manifold
from farhand.remote_site.perception.target_filter import Estimate, TargetFilter, TargetMotion

Array = NDArray[np.float64]

QUIET = TargetMotion((1e-6, 1e-5), (0.02, 0.04))
AGILE = TargetMotion((1e-3, 1e-2), (0.1, 0.2))

# Weight of a new innovation in the mean, the variance that noise leaves in that mean, and the length [standard
# deviations] from which the mean shows a lag.
_FORGET = 0.1
_NOISE = _FORGET / (2.0 - _FORGET)
_LAG = 1.2
_AGILE_FOR_S = 4.0
# A jump: two successive measurements are this far from the expectation and agree with each other.
_JUMP_STDS, _JUMP = 5.0, (0.010, math.radians(4.0))


class AdaptiveFilter:
    """Quiet and agile filter of one target, and the choice between them.

    Args:
        measurement_std: Standard deviation of a measurement's noise per axis [m, rad].
        space: Space of the target's points: positions or poses.
    """

    def __init__(self, measurement_std: tuple[float, ...], space: Manifold = POSE):
        self._space = space
        self._quiet = TargetFilter(space, measurement_std, QUIET)
        self._agile = TargetFilter(space, measurement_std, AGILE)
        self._least = np.repeat(_JUMP[: len(space.parts)], space.n_tangent // len(space.parts))
        self._lag = np.zeros(space.n_tangent)
        self._std = np.zeros(space.n_tangent)
        self._agile_until_s = -math.inf
        self._suspect: Array | None = None
        self._jumps = 0

    @property
    def time_s(self) -> float | None:
        """Time of the newest accepted measurement [s]; None before the first."""
        return self._agile.time_s

    def update(self, measured: Array, taken_s: float) -> None:
        """Process a measurement; an implausible one waits for a second that agrees with it. Shape (C,)."""
        if self._agile.time_s is None:
            self._quiet.update(measured, taken_s)
            self._agile.update(measured, taken_s)
            return
        difference, std = self._agile.innovation(measured, taken_s)
        if self._beyond(difference, std):
            if self._suspect is None or self._beyond(self._space.log(self._suspect, measured), std):
                self._suspect = np.array(measured)
                return
            self._restart(measured, taken_s)
            return
        self._suspect = None
        difference, std = self._quiet.innovation(measured, taken_s)
        self._lag += _FORGET * (difference / std - self._lag)
        self._std = std
        if float(np.linalg.norm(self._lag)) > _LAG:
            self._agile_until_s = taken_s + _AGILE_FOR_S
        self._quiet.update(measured, taken_s)
        self._agile.update(measured, taken_s)

    def estimate(self, now_s: float) -> Estimate:
        """Return the target's estimate now; call `update` before."""
        if now_s < self._agile_until_s:
            return replace(self._agile.estimate(now_s), jumps=self._jumps)
        # The quiet filter's covariance does not include a possible lag.
        estimate = self._quiet.estimate(now_s)
        lag = np.maximum(self._lag**2 - _NOISE, 0.0) * self._std**2
        covariance = estimate.covariance + np.diag(lag)
        return replace(estimate, covariance=covariance, quiet=True, jumps=self._jumps)

    def _beyond(self, difference: Array, std: Array) -> bool:
        return bool((np.abs(difference) > _JUMP_STDS * std + self._least).any())

    def _restart(self, measured: Array, taken_s: float) -> None:
        self._quiet.reset(measured, taken_s)
        self._agile.reset(measured, taken_s)
        self._lag[:] = 0.0
        self._suspect = None
        self._agile_until_s = taken_s + _AGILE_FOR_S
        self._jumps += 1
