"""Budget of each flow on a narrow link, so that commands and stops never wait behind a report, and during a silence.

Streams of which only the newest message counts get a share of the rate and skip what does not fit. Bulk is
sent in parts, each requested when the previous one was confirmed. Pictures come after everything else, and have a share
as well. The rest of the rate is for commands, stops and their acknowledgements, which are never delayed. While the other site is
silent, a gate reduces the sending to small probes, so that the end of an outage is detected at once.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from farhand.common.wire import keys
from farhand.common.wire.keys import Channel

if TYPE_CHECKING:
    from farhand.common.link.interface import Link

OVERHEAD_BYTES = 70
"""Bytes that Zenoh (about 30), TCP and IP (40) add to a message, for its budget [B]."""

_SHARES: dict[Channel, float] = {
    keys.TELEMETRY: 0.45,
    keys.PATH: 0.15,
    keys.PICTURE: 0.25,
    keys.INPUT: 0.45,
    keys.HEARTBEAT: 0.20,
}
LEAST_PICTURE_BPS = 30_000.0
"""Rate of a link below which no pictures are sent: its reports would suffer [bit/s]."""
_WHOLE_BYTES, _LEAST_PART_BYTES = 32_768, 256
_PART_S = 0.4


def budget_bytes_s(channel: Channel, rate_bps: float) -> float:
    """Return the budget of a channel [B/s]; 0: as much as it needs.

    Args:
        channel: Channel.
        rate_bps: Capacity of the link in each direction [bit/s]; 0: more than enough.
    """
    return _SHARES.get(channel, 0.0) * rate_bps / 8


def limit_flows(link: Link, rate_bps: float) -> None:
    """Give every stream of a site its share of a link of this rate [bit/s]; 0: more than enough."""
    for channel in _SHARES:
        link.limit(channel, budget_bytes_s(channel, rate_bps))


def part_bytes(rate_bps: float) -> int:
    """Return the size of the parts in which bulk is sent [B]; a stop waits for at most one of them.

    Args:
        rate_bps: Capacity of the link in each direction [bit/s]; 0: more than enough.
    """
    if not rate_bps:
        return _WHOLE_BYTES
    return max(_LEAST_PART_BYTES, min(_WHOLE_BYTES, round(_PART_S * rate_bps / 8)))


def period_s(channel: Channel, wanted_hz: float, n_bytes: int, rate_bps: float) -> float:
    """Return the time between two messages of a stream, as wanted or as its budget allows [s].

    Args:
        channel: Channel.
        wanted_hz: Wanted rate [Hz].
        n_bytes: Size of a message [B].
        rate_bps: Capacity of the link [bit/s]; 0: more than enough.
    """
    budget = budget_bytes_s(channel, rate_bps)
    return max(1.0 / wanted_hz, (n_bytes + OVERHEAD_BYTES) / budget if budget else 0.0)


_LEAST_SILENCE_S, _REPORTS = 0.5, 3.0
"""Silence that is usual on every link [s], and as a number of reports, which come rarely over a narrow one."""
_REPORT_BYTES, _REPORT_HZ = 264, 25.0
_OUTAGE, _DOUBTED = 2.0, 3.0
"""Silence that is an outage, and silence after which the other end is asked whether it is there; in usual silences."""
_QUIC_BYTES, _MARK_BYTES = 62, 19
"""Bytes that Zenoh and QUIC add to a message in QUIC's window, and the mark of a stream's message, absent in a silence [B]."""
_BEFORE, _LATE = 28, 4
"""Reports that are unacknowledged when an outage is noticed, with a one-way delay of 0.3 s, and rare ones later in half a minute."""
_ROOM_BYTES = {keys.TELEMETRY: 12_000, keys.TELEMETRY_BY_STOPS: 10_000, keys.TELEMETRY_BY_MAIN: 10_000}
"""Room for reports in the first window of each connection, 12 kB; the rest is for acknowledgements of stops, and events [B]."""
_REPORT_PAUSE_S, _RARE_PAUSE_S = 0.2, 5.0
_PAUSES_S = {keys.HEARTBEAT: 0.4, keys.STOP: 0.6, keys.LEASE: 2.0}
"""Pauses during a silence: between reports that find room in a window, and between all other messages, except on some
channels [s]. With them half a minute of a channel finds room."""


class Silence:
    """Silence of the other site, with the thresholds of one link, for any thread.

    Args:
        rate_bps: Capacity of the link [bit/s]; 0: more than enough. On a narrow link messages are rarer,
            and silence is longer.
        clock: Returns the time, on a clock that does not go back [s].
    """

    def __init__(self, rate_bps: float = 0.0, clock: Callable[[], float] = time.monotonic):
        self.clock = clock
        """Clock of the silence."""
        self.usual_s = max(
            _LEAST_SILENCE_S, _REPORTS * period_s(keys.TELEMETRY, _REPORT_HZ, _REPORT_BYTES, rate_bps)
        )
        """Longest silence that is usual [s]."""
        self._heard_s = clock()

    def heard(self) -> None:
        """Note the arrival of a message."""
        self._heard_s = self.clock()

    @property
    def lasts_s(self) -> float:
        """Time since the last arrival, or since the start [s]."""
        return self.clock() - self._heard_s

    @property
    def is_unusual(self) -> bool:
        """True while the silence is longer than usual."""
        return self.lasts_s > self.usual_s

    @property
    def outage_s(self) -> float:
        """Silence that is an outage, and no loss of single messages [s]."""
        return _OUTAGE * self.usual_s

    @property
    def doubted_s(self) -> float:
        """Silence after which the other end is asked whether it is still there [s]."""
        return _DOUBTED * self.usual_s


class SilenceGate:
    """Gate that passes all messages while the other site is heard, and few small ones while it is not.

    Over QUIC, data sent into an outage stays unacknowledged and fills the congestion window. Then only the
    transport's own probes leave, at intervals that double each time: the link would be found open after a
    time as long as the outage was.

    Args:
        silence: Silence of the other site.
    """

    def __init__(self, silence: Silence):
        self._silence, self._lock = silence, threading.Lock()
        self._sent_s: dict[Channel, float] = {}
        self._used_bytes: dict[Channel, int] = {}
        self.reports = keys.TELEMETRY
        """Channel of the report that was let out last in the present silence."""

    def lets_out(self, channel: Channel, n_bytes: int) -> bool:
        """Decide whether a message that its sender repeats or replaces may be sent now.

        Args:
            channel: Channel of the message.
            n_bytes: Size of the message, with the transport's own bytes [B].
        """
        with self._lock:
            if not self._silence.is_unusual:
                self._used_bytes.clear()
                return True
            if channel is keys.TELEMETRY:
                return self._lets_report_out(n_bytes - OVERHEAD_BYTES + _QUIC_BYTES)
            return self._is_due(channel, _PAUSES_S.get(channel, _RARE_PAUSE_S))

    def _lets_report_out(self, n_bytes: int) -> bool:
        """Let a report out on the first connection with room: each has a window of its own."""
        if not self._used_bytes:
            self._used_bytes[keys.TELEMETRY] = _BEFORE * (n_bytes + _MARK_BYTES) + _LATE * n_bytes
        for channel, room_bytes in _ROOM_BYTES.items():
            used_bytes = self._used_bytes.get(channel, 0) + n_bytes
            if used_bytes <= room_bytes:
                if not self._is_due(keys.TELEMETRY, _REPORT_PAUSE_S):
                    return False
                self._used_bytes[channel], self.reports = used_bytes, channel
                return True
        self.reports = keys.TELEMETRY
        return self._is_due(keys.TELEMETRY, _RARE_PAUSE_S)

    def _is_due(self, channel: Channel, pause_s: float) -> bool:
        """Decide whether a channel has paused long enough; its next pause begins then."""
        now_s = self._silence.clock()
        if now_s - self._sent_s.get(channel, -math.inf) < pause_s:
            return False
        self._sent_s[channel] = now_s
        return True
