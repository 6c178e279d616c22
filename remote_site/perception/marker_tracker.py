"""Simulated marker tracker: a camera's measurements, late, noisy, with gaps and a constant error."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidConfiguration
from farhand.common.model.manifold import Manifold

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TrackerNoise:
    """Errors of a tracker's measurements; standard deviations per axis.

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
        taken_s: Instant that it describes [s].
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
        """Show the tracker the target now, and return the measurement that has arrived.

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
