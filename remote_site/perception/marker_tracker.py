"""A simulated marker tracker: a camera's measurements of a target, late, noisy, with gaps and a constant error."""

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
    """What is wrong with a tracker's measurements; standard deviations per axis.

    Args:
        bias_m: Of the constant error of positions [m].
        bias_rad: Of the constant error of orientations [rad].
        jitter_m: Of the error of each measured position [m].
        jitter_rad: Of the error of each measured orientation [rad].
        dropout: Share of the measurements that are missing.
        latency_s: From the moment a measurement is of to its arrival [s].
        rate_hz: Measurements per second, and at most one at each look [Hz].

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
    """One measurement.

    Args:
        point: Position or pose in the world. Shape (C,).
        taken_s: The moment it is of [s].
    """

    point: Array
    taken_s: float


class MarkerTracker:
    """Measures where a target is; the same seed gives the same errors.

    Args:
        space: Where the target lives.
        noise: What is wrong with the measurements.
        seed: Of the errors.
    """

    def __init__(self, space: Manifold, noise: TrackerNoise, seed: int):
        self._space, self._noise = space, noise
        self._random = np.random.default_rng(seed)
        self._jitter = self._std(noise.jitter_m, noise.jitter_rad)
        self.bias = self._random.normal(size=space.n_tangent) * self._std(noise.bias_m, noise.bias_rad)
        """The constant error [m, rad]. Shape (T,)."""
        self._due_s = -math.inf
        self._under_way: deque[Measurement] = deque()

    @property
    def usual_age_s(self) -> float:
        """How old the newest measurement is that has arrived, at most, when none is missing [s]."""
        return self._noise.latency_s + 1.0 / self._noise.rate_hz

    def look(self, truth: Array | None, now_s: float) -> list[Measurement]:
        """Let the tracker see the target now, and take what has arrived by now.

        Args:
            truth: Where the target is now; None while it is out of sight. Shape (C,).
            now_s: Now; never earlier than at the look before [s].
        """
        if now_s >= self._due_s:
            period_s = 1.0 / self._noise.rate_hz
            # The tracker's own grid, unless nobody looked for a while.
            self._due_s = (self._due_s if self._due_s > now_s - period_s else now_s) + period_s
            # Both are drawn in any case, so that runs with other noises have the same errors.
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
