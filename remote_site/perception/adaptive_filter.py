"""A target that mostly stands still, sometimes moves, and may be put elsewhere: two filters side by side.

The *quiet* filter expects a target that hardly moves: it averages the noise away, but lags behind one that
does. The *agile* one follows. Which of them counts is decided by the quiet one's innovations: noise averages
out of them, a lag does not. That the target jumped is decided by the agile one's innovations, since the
quiet one's are large in any sway.
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

# Part of a new innovation in their mean, the variance that noise leaves in that mean, and the length [standard
# deviations] of a mean that means a lag.
_FORGET = 0.1
_NOISE = _FORGET / (2.0 - _FORGET)
_LAG = 1.2
_AGILE_FOR_S = 4.0
# A jump is as far from what was expected as this, in two measurements that agree with each other.
_JUMP_STDS, _JUMP = 5.0, (0.010, math.radians(4.0))


class AdaptiveFilter:
    """A quiet and an agile filter, and the choice between them.

    Args:
        measurement_std: Noise of one measurement per axis [m, rad].
        space: Where the target lives.
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
        """When the newest measurement that counted was taken [s]; None before the first."""
        return self._agile.time_s

    def update(self, measured: Array, taken_s: float) -> None:
        """Take a measurement into account; one that cannot be waits for a second that agrees. Shape (C,)."""
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
        """Where the target is by now. `update` must have been called."""
        if now_s < self._agile_until_s:
            return replace(self._agile.estimate(now_s), jumps=self._jumps)
        # A lag that may be there is not known to the filter itself.
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
