"""Delay of a byte stream on a slow link, with jitter of four distributions.

A byte never overtakes an earlier one, and each delay is correlated with the previous one. The line has a clock of
its own, which stands still during a stall.
"""

from __future__ import annotations

import math
from collections import deque
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


class DelayLine:
    """One direction of a connection: decides when each piece arrives, and how much may still be sent.

    Args:
        settings: Parameters of the line; those of messages (loss, duplicate, reorder) do not apply.
        stream: Name of the stream; each has its own random sequence.
    """

    def __init__(self, settings: DirectionSettings, stream: str = ""):
        self._settings = settings
        self._stream = stream
        self._jitter = self._new_jitter()
        self._time = LineTime()
        self._queue: deque[tuple[float, int]] = deque()  # (arrival in the line's own time, bytes)
        self._queued_bytes = 0
        self._sent_s = -math.inf  # time when the last bit leaves the sender
        self._last_due_s = -math.inf

    @property
    def settings(self) -> DirectionSettings:
        """Present parameters."""
        return self._settings

    @property
    def queued_bytes(self) -> int:
        """Bytes pushed and not yet popped."""
        return self._queued_bytes

    @property
    def free_bytes(self) -> int:
        """Bytes that may be pushed now. A sender who respects it never exceeds the bound of the queue."""
        return max(0, self._settings.queue_limit_bytes - self._queued_bytes)

    @property
    def next_due_s(self) -> float | None:
        """Arrival time of the oldest piece [s], None for none."""
        return self._time.of_caller(self._queue[0][0]) if self._queue else None

    def push(self, now_s: float, n_bytes: int) -> float:
        """Send a piece; an empty one (the end of the stream) keeps its place in the order, too.

        Args:
            now_s: The time [s], on any clock that does not go back.
            n_bytes: Size of the piece.

        Returns:
            Time of its arrival [s], unless the line is stalled before that.
        """
        start_s = max(self._time.on_line(now_s), self._sent_s)
        rate_bps = self._settings.rate_bps
        self._sent_s = start_s + (8 * n_bytes / rate_bps if rate_bps else 0.0)
        self._last_due_s = max(self._sent_s + self._jitter.draw_s(self._settings), self._last_due_s)
        self._queue.append((self._last_due_s, n_bytes))
        self._queued_bytes += n_bytes
        return self._time.of_caller(self._last_due_s)

    def pop(self) -> int:
        """Remove the oldest piece from the line; return its size [B].

        Raises:
            IndexError: No piece is in transit.
        """
        _, n_bytes = self._queue.popleft()
        self._queued_bytes -= n_bytes
        return n_bytes

    def clear(self) -> None:
        """Lose everything in transit."""
        self._queue.clear()
        self._queued_bytes = 0

    def change(self, settings: DirectionSettings) -> None:
        """Replace the parameters for later pieces; pieces in transit keep their times."""
        reseed = settings.seed != self._settings.seed
        self._settings = settings
        if reseed:
            self._jitter = self._new_jitter()

    def stall(self, now_s: float, until_s: float) -> None:
        """Stop the line's time.

        Args:
            now_s: The time [s].
            until_s: End of the stall [s]; replaces that of an earlier one, and `now_s` ends it.
        """
        self._time.stall(now_s, until_s)

    def _new_jitter(self) -> Jitter:
        return Jitter(Random(f"{self._settings.seed}/{self._stream}"))


class LineTime:
    """Conversion between the caller's time and the line's own.

    A stall is a stretch of the caller's time that does not exist on the line, so order, rate and spacing hold
    after it as before.
    """

    def __init__(self) -> None:
        self._resume_s = -math.inf
        self._behind_s = 0.0

    def on_line(self, now_s: float) -> float:
        """Convert the caller's time into the line's [s]."""
        return max(now_s, self._resume_s) - self._behind_s

    def of_caller(self, line_s: float) -> float:
        """Convert the line's time into the caller's [s], assuming no further stall until then."""
        return line_s + self._behind_s

    def stall(self, now_s: float, until_s: float) -> None:
        """Stop the line's time.

        Args:
            now_s: The caller's time [s].
            until_s: End of the stall [s]; replaces that of an earlier one, and `now_s` or less ends it.
        """
        frozen_s = self.on_line(now_s)
        self._resume_s = max(now_s, until_s)
        self._behind_s = self._resume_s - frozen_s
