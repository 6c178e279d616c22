"""Simulated sight: a simulated tracker's measurements of a target, filtered."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.manifold import Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import Target
from farhand.remote_site.perception.adaptive_filter import AdaptiveFilter
from farhand.remote_site.perception.marker_tracker import MarkerTracker, TrackerNoise
from farhand.remote_site.perception.target_filter import Estimate, TargetFilter, TargetMotion

Array = NDArray[np.float64]

# Filter settings of the planar task's target, which oscillates all the time.
_OSCILLATION = TargetMotion((2e-3,), (1.0,))
# A target counts as unseen once its newest measurement is older than usual by this: four missing at 30 Hz.
_MISSING_S = 0.13


class OscillatingTarget:
    """The paper's moving U: a plain oscillation about a mean, which can be moved.

    Args:
        settings: Mean, amplitude and period.
        phase_rad: Phase at time zero [rad].
        slide_m_s: Speed of a mean on its way to another place [m/s].
    """

    def __init__(self, settings: Target, phase_rad: float = 0.0, slide_m_s: float = 0.3):
        self._settings, self._phase_rad, self._slide_m_s = settings, phase_rad, slide_m_s
        self._mean = self._goal = np.array(settings.origin_m)
        self._moved_s = 0.0

    def move_to(self, mean_m: Array, now_s: float) -> None:
        """Slide the mean to another place, beginning now. Shape (D,) [m]."""
        self._mean, self._goal, self._moved_s = self._mean_m(now_s), np.array(mean_m), now_s

    def origin_m(self, now_s: float) -> Array:
        """Return the target's centre at a time. Shape (D,) [m]."""
        settings = self._settings
        angle = 2.0 * math.pi * now_s / settings.period_s + self._phase_rad
        return self._mean_m(now_s) + np.array(settings.amplitude_m) * math.sin(angle)

    def _mean_m(self, now_s: float) -> Array:
        way = self._goal - self._mean
        length = float(np.linalg.norm(way))
        travelled = self._slide_m_s * max(now_s - self._moved_s, 0.0)
        return self._goal if travelled >= length else self._mean + way * (travelled / length)


class SimulatedPerception:
    """Perception of one target by a simulated tracker and a filter.

    Args:
        truth: Returns the true point of the target at a time: position or pose in the world.
        tracker: Simulated tracker.
        target_filter: Filter of its measurements.
    """

    def __init__(
        self,
        truth: Callable[[float], Array],
        tracker: MarkerTracker,
        target_filter: TargetFilter | AdaptiveFilter,
    ):
        self._truth, self._tracker, self._filter = truth, tracker, target_filter
        self.in_sight = True
        """True if the tracker sees the target at all."""
        self.newest: Estimate | None = None
        """Estimate at the last look; None while the target is unseen."""

    @classmethod
    def of_oscillating(cls, target: OscillatingTarget, noise_std_m: float, seed: int) -> SimulatedPerception:
        """Return the planar task's perception: a noisy measurement at every look, without latency.

        Args:
            target: The target.
            noise_std_m: Standard deviation of the noise per axis [m].
            seed: Seed of the noise.
        """
        space = Manifold(target.origin_m(0.0).size)
        tracker = MarkerTracker(space, TrackerNoise(jitter_m=noise_std_m, rate_hz=math.inf), seed)
        return cls(target.origin_m, tracker, TargetFilter(space, (noise_std_m,), _OSCILLATION))

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        """See `Perception.observe`."""
        for measurement in self._tracker.look(self._truth(now_s) if self.in_sight else None, now_s):
            self._filter.update(*measurement)
        newest_s = self._filter.time_s
        if newest_s is None or now_s - newest_s > self._tracker.usual_age_s + _MISSING_S:
            self.newest = None
            return None
        self.newest = self._filter.estimate(now_s)
        return [TaskFrame.at(self.newest.point)]

    def true_origin_m(self, now_s: float) -> Array:
        """See `Perception.true_origin_m`."""
        return TaskFrame.at(self._truth(now_s)).b
