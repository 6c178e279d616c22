"""Simulated sight: measurements of a marker tracker, with delay, noise, gaps and a constant error, and their filter."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidConfiguration
from farhand.common.model.manifold import Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import Target
from farhand.remote_site.interface.sensing import Perception
from farhand.remote_site.perception.target_filter import AdaptiveFilter, Estimate, TargetFilter, TargetMotion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TrackerNoise:
    """Errors of a tracker's measurements, as standard deviations per axis.

    Args:
        bias_m: Standard deviation of the constant position error [m].
        bias_rad: Standard deviation of the constant orientation error [rad].
        jitter_m: Standard deviation of each measured position's error [m].
        jitter_rad: Standard deviation of each measured orientation's error [rad].
        dropout: Share of missing measurements.
        latency_s: Time from the instant that a measurement describes to its arrival [s].
        rate_hz: Measurements per second; at most one per look [Hz].

    Raises:
        InvalidConfiguration: When a number is out of range.
    """

    bias_m: float = 0.0
    bias_rad: float = 0.0
    jitter_m: float = 0.0
    jitter_rad: float = 0.0
    dropout: float = 0.0
    latency_s: float = 0.0
    rate_hz: float = 30.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            least = math.nextafter(0.0, 1.0) if name == "rate_hz" else 0.0
            if not least <= value <= (1.0 if name == "dropout" else math.inf):
                raise InvalidConfiguration("tracker", name, f"a number in its range, got {value}")


CLEAN = TrackerNoise()
TYPICAL = TrackerNoise(0.003, math.radians(1.0), 0.005, math.radians(2.0), 0.3, 0.06)
PRESETS = {"clean": CLEAN, "typical": TYPICAL}


class Measurement(NamedTuple):
    """One measurement of the target.

    Args:
        point: Position or pose in the world. Shape (C,).
        taken_s: Time that the measurement describes [s].
    """

    point: Array
    taken_s: float


class MarkerTracker:
    """Simulated tracker; the same seed gives the same errors.

    Args:
        space: Space of the target's points: positions or poses.
        noise: Errors of the measurements.
        seed: Seed of the errors.
    """

    def __init__(self, space: Manifold, noise: TrackerNoise, seed: int):
        self._space, self._noise = space, noise
        self._random = np.random.default_rng(seed)
        self._jitter = self._std(noise.jitter_m, noise.jitter_rad)
        self.bias = self._random.normal(size=space.n_tangent) * self._std(noise.bias_m, noise.bias_rad)
        """Constant error [m, rad]. Shape (T,)."""
        self._due_s = -math.inf
        self._under_way: deque[Measurement] = deque()

    @property
    def usual_age_s(self) -> float:
        """Largest age of the newest arrived measurement when none is missing [s]."""
        return self._noise.latency_s + 1.0 / self._noise.rate_hz

    def look(self, truth: Array | None, now_s: float) -> list[Measurement]:
        """Let the tracker observe the target, and return the measurements that have arrived.

        Args:
            truth: True point of the target now; None while it is out of sight. Shape (C,).
            now_s: Present time; never earlier than at the previous look [s].
        """
        if now_s >= self._due_s:
            period_s = 1.0 / self._noise.rate_hz
            # Measurements lie on the tracker's own grid of times, unless nobody looked for a while.
            self._due_s = (self._due_s if self._due_s > now_s - period_s else now_s) + period_s
            # Both are drawn in any case, so that runs with other noise levels share their random numbers.
            missing = self._random.random() < self._noise.dropout
            error = self.bias + self._random.normal(size=self.bias.size) * self._jitter
            if truth is not None and not missing:
                self._under_way.append(Measurement(self._space.exp(truth, error), now_s))
        arrived = []
        while self._under_way and self._under_way[0].taken_s + self._noise.latency_s <= now_s + 1e-9:
            arrived.append(self._under_way.popleft())
        return arrived

    def _std(self, position: float, rotation: float) -> Array:
        parts = (position, rotation)[: len(self._space.parts)]
        return np.repeat(parts, self._space.n_tangent // len(parts))


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
        if settings.amplitude_m is None:
            return self._mean_m(now_s)
        angle = 2.0 * math.pi * now_s / settings.period_s + self._phase_rad
        return self._mean_m(now_s) + np.array(settings.amplitude_m) * math.sin(angle)

    def _mean_m(self, now_s: float) -> Array:
        way = self._goal - self._mean
        length = float(np.linalg.norm(way))
        travelled = self._slide_m_s * max(now_s - self._moved_s, 0.0)
        return self._goal if travelled >= length else self._mean + way * (travelled / length)


class StillFrames:
    """Perception of frames that are known and stand still.

    Args:
        frames: The frames.
    """

    def __init__(self, frames: Sequence[TaskFrame]):
        self._frames = list(frames)

    def observe(self, now_s: float) -> list[TaskFrame]:
        """See `Perception.observe`."""
        return self._frames


class SimulatedPerception:
    """Perception of one target by a simulated tracker and a filter, beside which other frames may be seen.

    Args:
        truth: Returns the true point of the target at a time: position or pose in the world.
        tracker: Simulated tracker.
        target_filter: Filter of its measurements.
        before: Sights of the frames before the target's.
    """

    def __init__(
        self,
        truth: Callable[[float], Array],
        tracker: MarkerTracker,
        target_filter: TargetFilter | AdaptiveFilter,
        before: Sequence[Perception] = (),
    ):
        self._before = before
        self._truth, self._tracker, self._filter = truth, tracker, target_filter
        self.in_sight = True
        """True if the tracker sees the target at all."""
        self.newest: Estimate | None = None
        """Estimate at the last look; None while the target is unseen."""

    @classmethod
    def of_oscillating(
        cls, target: OscillatingTarget, noise_std_m: float, seed: int, before: Sequence[Perception] = ()
    ) -> SimulatedPerception:
        """Return a point's perception: a noisy measurement at every look, without latency.

        Args:
            target: The target.
            noise_std_m: Standard deviation of the noise per axis [m].
            seed: Seed of the noise.
            before: Sights of the frames before the target's.
        """
        space = Manifold(target.origin_m(0.0).size)
        tracker = MarkerTracker(space, TrackerNoise(jitter_m=noise_std_m, rate_hz=math.inf), seed)
        return cls(target.origin_m, tracker, TargetFilter(space, (noise_std_m,), _OSCILLATION), before)

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        """See `Perception.observe`."""
        for measurement in self._tracker.look(self._truth(now_s) if self.in_sight else None, now_s):
            self._filter.update(*measurement)
        others = [sight.observe(now_s) for sight in self._before]
        newest_s = self._filter.time_s
        if newest_s is None or now_s - newest_s > self._tracker.usual_age_s + _MISSING_S:
            self.newest = None
            return None
        self.newest = self._filter.estimate(now_s)
        seen = [frames for frames in others if frames is not None]
        if len(seen) < len(others):
            return None
        return [*chain.from_iterable(seen), TaskFrame.at(self.newest.point)]

    def true_origin_m(self, now_s: float) -> Array:
        """See `TrueTarget.true_origin_m`."""
        return TaskFrame.at(self._truth(now_s)).b
