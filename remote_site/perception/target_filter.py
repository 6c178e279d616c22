"""Kalman filter on a manifold: a target's point and velocity, from measurements of its position or pose.

The model is constant velocity disturbed by white acceleration, with the same parameters for all axes of a part
(positions, rotations). The covariance of an axis with its velocity is then one 2 x 2 matrix per part,
whatever the dimension. The mean is a point of the manifold and the velocity a tangent, so positions and poses
share one code path.

`AdaptiveFilter` runs two such filters in parallel, for a target that mostly stands still, sometimes moves, and may jump.

The *quiet* filter expects a target that hardly moves: it averages the noise away, but lags behind a moving
target. The *agile* one follows. The innovations of the quiet filter decide which of the two applies: noise
averages out of them, a lag does not. The innovations of the agile filter decide whether the target jumped,
since in any sway the quiet filter's are large.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.manifold import POSE, Manifold, exp_at, log_at

Array = NDArray[np.float64]

# After this time without a measurement [s], the predicted velocity decays.
_STEADY_S, _DECAY_S = 0.15, 0.5


@dataclass(frozen=True)
class TargetMotion:
    """Expected motion of a target, with one number for positions and one for rotations.

    Args:
        acceleration_density: Spectral density of the acceleration [m^2/s^3, rad^2/s^3].
        speed_std: Prior standard deviation of the speed at the first sight [m/s, rad/s].
    """

    acceleration_density: tuple[float, ...]
    speed_std: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimate of the target.

    Args:
        point: Position or pose in the world. Shape (C,).
        velocity: Velocity of the target [m/s, rad/s]. Shape (T,).
        covariance: Covariance of the point [m^2, rad^2]. Shape (T, T).
        quiet: True if the target seems to stand still.
        jumps: Number of jumps of the target.
    """

    point: Array
    velocity: Array
    covariance: Array
    quiet: bool = False
    jumps: int = 0


class TargetFilter:
    """Kalman filter of one target; measurements must come in the order of their times.

    Args:
        space: Space of the target's points: positions or poses.
        measurement_std: Standard deviation of a measurement's noise per axis [m, rad]. One number for each
            part.
        motion: Expected motion of the target.
    """

    def __init__(self, space: Manifold, measurement_std: tuple[float, ...], motion: TargetMotion):
        self._space = space
        self._r = np.maximum(measurement_std, 1e-6) ** 2
        self._q = np.array(motion.acceleration_density)
        self._speed_variance = np.array(motion.speed_std) ** 2
        self._part = np.repeat(np.arange(len(space.parts)), space.n_tangent // len(space.parts))
        self._time_s: float | None = None
        self._point = self._velocity = np.empty(0)
        self._covariance = np.empty((len(space.parts), 2, 2))  # of [point, velocity] of an axis, per part

    @property
    def time_s(self) -> float | None:
        """Time of the newest measurement [s]; None before the first."""
        return self._time_s

    def reset(self, measured: Array, taken_s: float) -> None:
        """Restart from one measurement. Shape (C,)."""
        self._point, self._velocity = np.array(measured), np.zeros(self._space.n_tangent)
        self._covariance[:] = 0.0
        self._covariance[:, 0, 0], self._covariance[:, 1, 1] = self._r, self._speed_variance
        self._time_s = taken_s

    def innovation(self, measured: Array, taken_s: float) -> tuple[Array, Array]:
        """Return a measurement's difference from the prediction, and its standard deviation.

        Shapes (T,), (T,).
        """
        point, covariance = self._predicted(taken_s)
        return self._difference(point, measured), np.sqrt(covariance[:, 0, 0] + self._r)[self._part]

    def update(self, measured: Array, taken_s: float) -> None:
        """Process a measurement. Shape (C,)."""
        if self._time_s is None:
            self.reset(measured, taken_s)
            return
        point, covariance = self._predicted(taken_s)
        gains = covariance[:, :, 0] / (covariance[:, 0, 0] + self._r)[:, None]
        difference = self._difference(point, measured)
        self._point = _moved(point, gains[self._part, 0] * difference)
        self._velocity = self._velocity + gains[self._part, 1] * difference
        self._covariance = covariance - gains[:, :, None] * covariance[:, None, 0, :]
        self._time_s = taken_s

    def estimate(self, now_s: float) -> Estimate:
        """Return the present estimate of the target, extrapolated for a moment; call `update` before."""
        age_s = self._age_s(now_s)
        late_s = max(age_s - _STEADY_S, 0.0)
        decay = float(np.exp(-late_s / _DECAY_S))
        gone_s = min(age_s, _STEADY_S) + _DECAY_S * (1.0 - decay)
        covariance = self._predicted_covariance(age_s)
        return Estimate(
            _moved(self._point, gone_s * self._velocity),
            decay * self._velocity,
            np.diag(covariance[self._part, 0, 0]),
        )

    def _predicted(self, now_s: float) -> tuple[Array, Array]:
        dt = self._age_s(now_s)
        return _moved(self._point, dt * self._velocity), self._predicted_covariance(dt)

    def _predicted_covariance(self, dt: float) -> Array:
        F = np.array([[1.0, dt], [0.0, 1.0]])
        Q = np.array([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]])
        return F @ self._covariance @ F.T + self._q[:, None, None] * Q

    def _difference(self, base: Array, point: Array) -> Array:
        out = np.empty(self._space.n_tangent)
        log_at(base, point, out)
        return out

    def _age_s(self, now_s: float) -> float:
        if self._time_s is None:
            raise ValueError("nothing was measured yet")
        return max(now_s - self._time_s, 0.0)


def _moved(point: Array, tangent: Array) -> Array:
    out = np.empty(point.size)
    exp_at(point, tangent, out)
    return out


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
        """Process a measurement; an implausible one is used only if the next one agrees with it. Shape (C,)."""
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
        """Return the present estimate of the target; call `update` before."""
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
