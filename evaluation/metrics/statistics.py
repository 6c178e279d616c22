"""What a number of trials says: rates with Wilson's interval."""

from __future__ import annotations

import math

_Z_95 = 1.959963984540054


def wilson_interval(successes: int, trials: int, z: float = _Z_95) -> tuple[float, float]:
    """Interval for the rate behind so many successes, by default of 95 % (Wilson 1927).

    Raises:
        ValueError: When the counts are no counts of successes among trials.
    """
    if trials < 0 or not 0 <= successes <= trials:
        raise ValueError(f"0 <= successes <= trials, got {successes} of {trials}")
    if trials == 0:
        return 0.0, 1.0
    rate, square = successes / trials, z * z / trials
    centre = (rate + square / 2) / (1 + square)
    half = z / (1 + square) * math.sqrt(rate * (1 - rate) / trials + square / (4 * trials))
    low = 0.0 if successes == 0 else max(0.0, centre - half)
    high = 1.0 if successes == trials else min(1.0, centre + half)
    return low, high
