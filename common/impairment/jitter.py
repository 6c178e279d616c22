"""Scatter of the delay: four distributions, each delay correlated with the previous one."""

from __future__ import annotations

import math
from random import Random

from farhand.common.impairment.impairment import DirectionSettings

NORMAL_CUTOFF = 3.0
"""Number of standard deviations at which a normal deviate is truncated."""

# A Pareto variable of shape 3 from 1 on, truncated at 5, has this mean and this standard deviation:
# m = 3/2 - 1/(2 5^2), s^2 = 3 - 2/5 - m^2.
_PARETO_CUTOFF, _PARETO_MEAN, _PARETO_DEVIATION = 5.0, 1.48, 0.64
# netem's mixture, both parts taken at the same quantile, and its standard deviation.
_NORMAL_SHARE, _PARETO_SHARE, _MIXTURE_DEVIATION = 0.25, 0.75, 0.9647463219


class Jitter:
    """Source of successive delays.

    A normal sequence z with a correlation of r between neighbours is mapped to the wanted distribution, so
    the correlation changes no distribution. (netem's own mixing of neighbours does.)

    Args:
        random: Random generator for this purpose alone.
    """

    def __init__(self, random: Random):
        self._random = random
        self._z: float | None = None

    def draw_s(self, settings: DirectionSettings) -> float:
        """Draw the next delay [s]; never negative."""
        delay_ms, jitter_ms = settings.delay_ms, settings.jitter_ms
        if not jitter_ms:
            return delay_ms / 1000
        z = self._next_z(settings.correlation / 100)
        if settings.distribution == "uniform":
            deviate = math.erf(z / math.sqrt(2))
        elif settings.distribution == "normal":
            # Truncated symmetrically: the mean stays the delay, and nothing arrives before it was sent.
            deviate = _truncated(z, min(NORMAL_CUTOFF, delay_ms / jitter_ms))
        elif settings.distribution == "pareto":
            deviate = _pareto(z)
        else:
            mixture = _NORMAL_SHARE * _truncated(z, NORMAL_CUTOFF) + _PARETO_SHARE * _pareto(z)
            deviate = max(mixture / _MIXTURE_DEVIATION, -delay_ms / jitter_ms)
        return max(0.0, delay_ms + jitter_ms * deviate) / 1000  # rounding alone could make it negative

    def _next_z(self, rank_correlation: float) -> float:
        noise = self._random.gauss(0.0, 1.0)
        if self._z is None or not rank_correlation:
            self._z = noise
        else:
            r = 2 * math.sin(math.pi / 6 * rank_correlation)  # Pearson's r of z for this rank correlation
            self._z = r * self._z + math.sqrt(max(0.0, 1 - r * r)) * noise
        return self._z


def _truncated(z: float, bound: float) -> float:
    return max(-bound, min(bound, z))


def _pareto(z: float) -> float:
    """Return the standardised Pareto deviate at the quantile of z."""
    beyond = math.erfc(z / math.sqrt(2)) / 2  # P(Z > z)
    beyond = max(beyond, _PARETO_CUTOFF**-3)
    return (beyond ** (-1 / 3) - _PARETO_MEAN) / _PARETO_DEVIATION
