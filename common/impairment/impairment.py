"""Settings of an impaired link: what each direction does to the traffic.

Names and units are those of netem (ms, %, bit/s). The models that apply them are pure, seeded and without a
clock; the caller passes the time, so that the same model runs in real and in virtual time:

    delay_line.py    a stream, which keeps its order, and the jitter of its delay: the relay for a TCP
                     connection
    burst_loss.py    loss at random, alone or in bursts (Gilbert-Elliott)
    message_line.py  messages, which may be lost, duplicated, corrupted and overtaken: the relay for UDP
                     datagrams, and the in-process link
    link_profile.py  named settings, and those that change with time
"""

from __future__ import annotations

import math
from typing import Literal

import msgspec

Distribution = Literal["none", "uniform", "normal", "pareto", "paretonormal"]
Outage = Literal["none", "stall", "reset", "blackhole"]

MAX_DELAY_MS = 3_600_000.0
MAX_QUEUE_BYTES = 2**30
UNLIMITED_QUEUE_BYTES = 4 * 2**20
"""Automatic queue of a link without a rate: 4 MiB pass 14 MB/s at 300 ms."""
MIN_QUEUE_BYTES = 4096
"""Smallest automatic queue of a link with a rate."""

MESSAGES_ONLY = ("loss", "gemodel_p", "duplicate", "corrupt", "reorder")
"""Fields that only a link of messages can apply: TCP hides them by retransmission."""

_RANGES = {
    "delay_ms": MAX_DELAY_MS,
    "jitter_ms": MAX_DELAY_MS,
    "correlation": 100.0,
    "loss": 100.0,
    "loss_correlation": 99.9,  # at 100 % the first message would decide about all
    "gemodel_p": 100.0,
    "gemodel_r": 100.0,
    "gemodel_1_h": 100.0,
    "gemodel_1_k": 100.0,
    "duplicate": 100.0,
    "corrupt": 100.0,
    "reorder": 100.0,
    "reorder_ms": MAX_DELAY_MS,
    "rate_bps": 1e12,
    "queue_bytes": MAX_QUEUE_BYTES,
}


class DirectionSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Impairment of one direction of the link.

    Raises:
        ValueError: A value is not finite, negative, out of range or contradicts another one.
    """

    delay_ms: float = 0.0
    """Mean one-way delay [ms]."""
    jitter_ms: float = 0.0
    """Scatter of the delay [ms]: half width (uniform) or standard deviation (the others). Unlike netem's it leaves the packets
    of a path in order, as the queues do from which it comes; `reorder` overtakes."""
    correlation: float = 0.0
    """Rank correlation of a delay with the previous one [%]."""
    distribution: Distribution = "uniform"
    """Distribution of the jitter; `none` goes with a jitter of 0."""
    loss: float = 0.0
    """Share of lost messages [%]."""
    loss_correlation: float = 0.0
    """Correlation of a loss with the previous one [%]; the share stays."""
    gemodel_p: float = 0.0
    """Gilbert-Elliott: probability per message to turn from good to bad [%]; 0 switches the model off."""
    gemodel_r: float = 100.0
    """Probability per message to turn from bad to good [%]."""
    gemodel_1_h: float = 100.0
    """Loss while bad [%]."""
    gemodel_1_k: float = 0.0
    """Loss while good [%]."""
    duplicate: float = 0.0
    """Share of messages that arrive twice [%]."""
    corrupt: float = 0.0
    """Share of messages in which one bit is inverted in transit [%]; a transport that checks them drops them."""
    reorder: float = 0.0
    """Share of messages that arrive early and so overtake [%]."""
    reorder_ms: float = 0.0
    """Time that such a message gains [ms]; 0 skips the whole delay, as netem does, which no real path can."""
    gap: int = 1
    """Only every n-th message may overtake, with this n."""
    rate_bps: float = 0.0
    """Data rate [bit/s]; 0 is unlimited."""
    queue_bytes: int = 0
    """Largest number of bytes in transit; 0 chooses twice the product of rate and delay."""
    seed: int = 0
    """Seed of all random numbers."""

    def __post_init__(self) -> None:
        for name, highest in _RANGES.items():
            if not 0 <= getattr(self, name) <= highest:  # NaN fails as well
                value = getattr(self, name)
                raise ValueError(f"{name} must be a finite number from 0 to {highest:g}, not {value}")
        if 0 < self.rate_bps < 1:
            raise ValueError(f"rate_bps must be 0 (unlimited) or at least 1 bit/s, not {self.rate_bps}")
        if self.jitter_ms > self.delay_ms:
            raise ValueError(f"jitter_ms ({self.jitter_ms}) must not exceed delay_ms ({self.delay_ms})")
        if self.jitter_ms > 0 and self.distribution == "none":
            raise ValueError('distribution must not be "none" for a jitter_ms above 0')
        if self.loss and self.gemodel_p:
            raise ValueError("loss and gemodel_p are two models of the same thing: set one of them to 0")
        if self.gemodel_p and not self.gemodel_r:
            raise ValueError(
                "gemodel_r must be above 0, or the link stays bad for ever; a loss of 100 does so"
            )
        if self.gap < 1:
            raise ValueError(f"gap must be at least 1, not {self.gap}")

    @property
    def bandwidth_delay_bytes(self) -> float:
        """Bytes that fill the line at its rate [B]; 0 if the rate is unlimited."""
        return self.rate_bps / 8 * (self.delay_ms + self.jitter_ms) / 1000

    @property
    def queue_limit_bytes(self) -> int:
        """Bound of the queue [B]; computed if `queue_bytes` is 0."""
        if self.queue_bytes:
            return self.queue_bytes
        if not self.rate_bps:
            return UNLIMITED_QUEUE_BYTES
        return min(MAX_QUEUE_BYTES, max(MIN_QUEUE_BYTES, math.ceil(2 * self.bandwidth_delay_bytes)))


class LinkSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of both directions of the link."""

    uplink: DirectionSettings = msgspec.field(default_factory=DirectionSettings)
    """From the local site to the remote site."""
    downlink: DirectionSettings = msgspec.field(default_factory=DirectionSettings)
    """From the remote site back."""

    def short_queues(self) -> list[str]:
        """List a warning for each direction whose queue limits its rate."""
        return [
            f"{name}: queue_bytes {direction.queue_limit_bytes} is less than rate times delay "
            f"({direction.bandwidth_delay_bytes:.0f}), so the queue is the limit"
            for name, direction in (("uplink", self.uplink), ("downlink", self.downlink))
            if direction.queue_limit_bytes < direction.bandwidth_delay_bytes
        ]

    def beyond_streams(self) -> list[str]:
        """List the fields in force that a TCP connection cannot apply, such as `uplink.loss`."""
        return [
            f"{direction}.{name}"
            for direction in ("uplink", "downlink")
            for name in MESSAGES_ONLY
            if getattr(getattr(self, direction), name)
        ]
