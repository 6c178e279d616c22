"""How the remote site sees its task frames: a protocol, and the simulated oscillating target."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from common.task import Target
from common.task_frame import TaskFrame

Array = NDArray[np.float64]


class Perception(Protocol):
    """What the remote site needs to know about its surroundings, local to it and without delay."""

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        """The task frames as estimated now, in the order of the task's `frame_names`; None while unseen."""
        ...

    def true_origin_m(self, now_s: float) -> Array | None:
        """Where the first frame really is. Shape (D,) [m]. None where nobody can know."""
        ...


class OscillatingTarget:
    """The paper's moving U: a plain oscillation about a mean, which can be moved.

    Args:
        settings: Mean, amplitude and period.
        phase_rad: Phase at time zero [rad].
        slide_m_s: Speed at which a moved mean travels [m/s].
    """

    def __init__(self, settings: Target, phase_rad: float = 0.0, slide_m_s: float = 0.3):
        self._settings, self._phase_rad, self._slide_m_s = settings, phase_rad, slide_m_s
        self._mean = self._goal = np.array(settings.origin_m)
        self._moved_s = 0.0

    def move_to(self, mean_m: Array, now_s: float) -> None:
        """Have the mean slide to another place from now on. Shape (D,) [m]."""
        self._mean, self._goal, self._moved_s = self._mean_m(now_s), np.array(mean_m), now_s

    def origin_m(self, now_s: float) -> Array:
        """Its centre. Shape (D,) [m]."""
        settings = self._settings
        angle = 2.0 * math.pi * now_s / settings.period_s + self._phase_rad
        return self._mean_m(now_s) + np.array(settings.amplitude_m) * math.sin(angle)

    def _mean_m(self, now_s: float) -> Array:
        way = self._goal - self._mean
        length = float(np.linalg.norm(way))
        travelled = self._slide_m_s * max(now_s - self._moved_s, 0.0)
        return self._goal if travelled >= length else self._mean + way * (travelled / length)


class PositionFilter:
    """Linear Kalman filter of a position under random acceleration, all axes alike.

    Args:
        measurement_std_m: Noise of one measurement per axis [m].
        acceleration_std_m_s2: How strongly the target may accelerate [m/s^2].
    """

    def __init__(self, measurement_std_m: float, acceleration_std_m_s2: float = 0.3):
        self._r = max(measurement_std_m, 1e-6) ** 2
        self._q = acceleration_std_m_s2**2
        self._mean: Array | None = None  # rows: position, velocity; columns: axes
        self._covariance = np.diag([self._r, 1.0])
        self._time_s = 0.0

    def update(self, measured_m: Array, now_s: float) -> Array:
        """Estimated position after a measurement. Shape (D,) [m]."""
        if self._mean is None:
            self._mean = np.stack([measured_m, np.zeros_like(measured_m)])
        else:
            dt = now_s - self._time_s
            F = np.array([[1.0, dt], [0.0, 1.0]])
            G = np.array([0.5 * dt**2, dt])
            self._mean = F @ self._mean
            self._covariance = F @ self._covariance @ F.T + self._q * np.outer(G, G)
            gain = self._covariance[:, 0] / (self._covariance[0, 0] + self._r)
            self._mean = self._mean + np.outer(gain, measured_m - self._mean[0])
            self._covariance = self._covariance - np.outer(gain, self._covariance[0])
        self._time_s = now_s
        return self._mean[0].copy()


class SimulatedPerception:
    """Noisy measurements of an oscillating target, filtered.

    Args:
        target: The target.
        noise_std_m: Measurement noise per axis [m].
        seed: Of the noise.
    """

    def __init__(self, target: OscillatingTarget, noise_std_m: float, seed: int):
        self._target = target
        self._noise_std_m = noise_std_m
        self._random = np.random.default_rng(seed)
        self._filter = PositionFilter(noise_std_m)

    def observe(self, now_s: float) -> list[TaskFrame]:
        """See `Perception.observe`."""
        truth = self._target.origin_m(now_s)
        measured = truth + self._random.normal(0.0, self._noise_std_m, truth.shape)
        return [TaskFrame(np.eye(truth.size), self._filter.update(measured, now_s))]

    def true_origin_m(self, now_s: float) -> Array:
        """See `Perception.true_origin_m`."""
        return self._target.origin_m(now_s)

    def move_to(self, mean_m: Array, now_s: float) -> None:
        """See `OscillatingTarget.move_to`."""
        self._target.move_to(mean_m, now_s)
