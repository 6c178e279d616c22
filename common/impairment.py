"""What a slow link does to a stream of bytes: pure, seeded and without a clock.

A `DelayLine` is one direction of one connection. The caller brings the time, so the same model runs in
virtual time in a test and in real time in the relay. The names and units of the settings are netem's
(ms, bit/s). A stream keeps its order: a byte never overtakes an earlier one, whatever its jitter.
"""

from __future__ import annotations

import math
from collections import deque
from random import Random
from typing import Literal

import msgspec

Distribution = Literal["none", "uniform", "normal"]
Outage = Literal["none", "stall", "reset", "blackhole"]

MAX_DELAY_MS = 3_600_000.0
MAX_QUEUE_BYTES = 2**30
UNLIMITED_QUEUE_BYTES = 4 * 2**20
"""Automatic queue of a link without a rate: 4 MiB pass 14 MB/s at 300 ms."""
MIN_QUEUE_BYTES = 4096
"""Smallest automatic queue of a link with a rate."""
NORMAL_CUTOFF = 3.0
"""A normal jitter is truncated at so many standard deviations."""


class DirectionSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How one direction of the link treats what passes.

    Raises:
        ValueError: A value is not finite, negative, out of range or contradicts another one.
    """

    delay_ms: float = 0.0
    """Mean one-way delay [ms]."""
    jitter_ms: float = 0.0
    """Scatter of the delay [ms]: half width (uniform) or standard deviation (normal)."""
    distribution: Distribution = "uniform"
    """How the jitter is distributed; `none` goes with a jitter of 0."""
    rate_bps: float = 0.0
    """Data rate [bit/s]; 0 is unlimited."""
    queue_bytes: int = 0
    """Most bytes under way at once; 0 chooses twice the product of rate and delay."""
    seed: int = 0
    """Seed of the jitter."""

    def __post_init__(self) -> None:
        _require_range("delay_ms", self.delay_ms, MAX_DELAY_MS)
        _require_range("jitter_ms", self.jitter_ms, MAX_DELAY_MS)
        _require_range("rate_bps", self.rate_bps, 1e12)
        _require_range("queue_bytes", self.queue_bytes, MAX_QUEUE_BYTES)
        if 0 < self.rate_bps < 1:
            raise ValueError(f"rate_bps must be 0 (unlimited) or at least 1 bit/s, not {self.rate_bps}")
        if self.jitter_ms > self.delay_ms:
            raise ValueError(f"jitter_ms ({self.jitter_ms}) must not exceed delay_ms ({self.delay_ms})")
        if self.jitter_ms > 0 and self.distribution == "none":
            raise ValueError('distribution must be "uniform" or "normal" for a jitter_ms above 0')

    @property
    def bandwidth_delay_bytes(self) -> float:
        """Bytes that fill the line at its rate [B]; 0 where the rate is unlimited."""
        return self.rate_bps / 8 * (self.delay_ms + self.jitter_ms) / 1000

    @property
    def queue_limit_bytes(self) -> int:
        """The bound of the queue [B], chosen where `queue_bytes` is 0."""
        if self.queue_bytes:
            return self.queue_bytes
        if not self.rate_bps:
            return UNLIMITED_QUEUE_BYTES
        return min(MAX_QUEUE_BYTES, max(MIN_QUEUE_BYTES, math.ceil(2 * self.bandwidth_delay_bytes)))


class LinkSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Both directions of the link."""

    uplink: DirectionSettings = msgspec.field(default_factory=DirectionSettings)
    """From the local site to the remote site."""
    downlink: DirectionSettings = msgspec.field(default_factory=DirectionSettings)
    """From the remote site back."""


class DelayLine:
    """Decides when each piece of a stream arrives, and how much may still be sent.

    Args:
        settings: The line's parameters.
        stream: Name of the stream; each has a random sequence of its own.
    """

    def __init__(self, settings: DirectionSettings, stream: str = ""):
        self._settings = settings
        self._stream = stream
        self._random = self._new_random()
        self._queue: deque[tuple[float, int]] = deque()  # (due in the line's own time, bytes)
        self._queued_bytes = 0
        self._sent_s = -math.inf  # when the last bit has left the sender
        self._last_due_s = -math.inf
        self._resume_s = -math.inf
        self._stalled_s = 0.0  # how far the line's own time is behind the caller's

    @property
    def settings(self) -> DirectionSettings:
        """The parameters in force."""
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
        """When the oldest piece arrives [s], None if nothing is under way."""
        return self._queue[0][0] + self._stalled_s if self._queue else None

    def push(self, now_s: float, n_bytes: int) -> float:
        """Send a piece; one of no bytes (the end of the stream) takes its place in the order, too.

        Args:
            now_s: The time [s], on any clock that does not go back.
            n_bytes: Size of the piece.

        Returns:
            When it arrives [s], unless the line is stalled before that.
        """
        start_s = max(self._line_time(now_s), self._sent_s)
        rate_bps = self._settings.rate_bps
        self._sent_s = start_s + (8 * n_bytes / rate_bps if rate_bps else 0.0)
        self._last_due_s = max(self._sent_s + self._draw_delay_s(), self._last_due_s)
        self._queue.append((self._last_due_s, n_bytes))
        self._queued_bytes += n_bytes
        return self._last_due_s + self._stalled_s

    def pop(self) -> int:
        """Take the oldest piece off the line; returns its size [B].

        Raises:
            IndexError: Nothing is under way.
        """
        _, n_bytes = self._queue.popleft()
        self._queued_bytes -= n_bytes
        return n_bytes

    def clear(self) -> None:
        """Lose everything under way."""
        self._queue.clear()
        self._queued_bytes = 0

    def change(self, settings: DirectionSettings) -> None:
        """Replace the parameters for what is pushed from now on; what is under way keeps its times."""
        reseed = settings.seed != self._settings.seed
        self._settings = settings
        if reseed:
            self._random = self._new_random()

    def stall(self, now_s: float, until_s: float) -> None:
        """Let time stand still on the line, so that order, rate and spacing hold afterwards as before.

        Args:
            now_s: The time [s].
            until_s: When it goes on [s]; replaces an earlier stall, and `now_s` ends it.
        """
        frozen_s = self._line_time(now_s)
        self._resume_s = max(now_s, until_s)
        self._stalled_s = self._resume_s - frozen_s

    def _line_time(self, now_s: float) -> float:
        return max(now_s, self._resume_s) - self._stalled_s

    def _new_random(self) -> Random:
        return Random(f"{self._settings.seed}/{self._stream}")

    def _draw_delay_s(self) -> float:
        delay_ms, jitter_ms = self._settings.delay_ms, self._settings.jitter_ms
        if not jitter_ms:
            return delay_ms / 1000
        if self._settings.distribution == "uniform":
            return (delay_ms + self._random.uniform(-jitter_ms, jitter_ms)) / 1000
        # Truncated on both sides alike: the mean stays the delay and nothing arrives before it was sent.
        bound_ms = min(NORMAL_CUTOFF * jitter_ms, delay_ms)
        return (delay_ms + max(-bound_ms, min(bound_ms, self._random.gauss(0.0, jitter_ms)))) / 1000


def _require_range(name: str, value: float, highest: float) -> None:
    if not 0 <= value <= highest:  # NaN fails as well
        raise ValueError(f"{name} must be a finite number from 0 to {highest:g}, not {value}")
