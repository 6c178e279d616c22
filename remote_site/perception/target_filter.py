"""Kalman filter on a manifold: a target's point and velocity, from measurements of its position or pose.

Model: constant velocity disturbed by white acceleration, with the same parameters for all axes of a part
(positions, rotations). The covariance of an axis with its velocity is then one 2 x 2 matrix per part,
whatever the dimension. The mean is a point of the manifold and the velocity a tangent, so positions and poses
share one code path.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.manifold import Manifold, exp_at, log_at

Array = NDArray[np.float64]

# After this time without a measurement [s], the predicted velocity decays.
_STEADY_S, _DECAY_S = 0.15, 0.5


@dataclass(frozen=True)
class TargetMotion:
    """Expected motion of a target; one number for positions, and one for rotations.

    Args:
        acceleration_density: Spectral density of the acceleration [m^2/s^3, rad^2/s^3].
        speed_std: Standard deviation of its speed when it is seen for the first time [m/s, rad/s].
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
        quiet: True if it has been standing still, as far as that can be told.
        jumps: Number of times that it was found elsewhere.
    """

    point: Array
    velocity: Array
    covariance: Array
    quiet: bool = False
    jumps: int = 0


class TargetFilter:
    """Kalman filter of one target; takes measurements in the order of their times.

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
        """Restart from this measurement alone. Shape (C,)."""
        self._point, self._velocity = np.array(measured), np.zeros(self._space.n_tangent)
        self._covariance[:] = 0.0
        self._covariance[:, 0, 0], self._covariance[:, 1, 1] = self._r, self._speed_variance
        self._time_s = taken_s

    def innovation(self, measured: Array, taken_s: float) -> tuple[Array, Array]:
        """Return a measurement's difference from the expectation, and its standard deviation.

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
        """Return the target's estimate now, extrapolated for a moment; call `update` before."""
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
