"""Rate for the streams of a lossy QUIC connection, from the losses and delays that each site measures.

QUIC takes lost packets for congestion, even those lost by a radio link. Its window then shrinks to two full packets
per round trip, one of which it keeps free; datagrams that do not fit wait for seconds, and old reports arrive in
place of new ones. Each site measures the losses and the excess delay of the other's streams, and reports both in a
mark on its own messages. While these are high, the streams share a rate that the smallest window lets out at once.
"""

from __future__ import annotations

import secrets
import struct
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from farhand.common.wire import keys
from farhand.common.wire.keys import Channel

_LEAST_WINDOW_BYTES = 1400
"""Bytes per round trip in the smallest window: one packet of the size that QUIC finds on most paths [B]."""
SHARES: dict[Channel, float] = {
    keys.TELEMETRY: 0.75,
    keys.INPUT: 0.55,
    keys.HEARTBEAT: 0.20,
}
"""Share of each stream in that rate; the streams have a connection of their own."""
_LOSSY, _HARMLESS = 0.02, 0.01
"""Loss above which the streams are slowed down, and loss below which that ends (hysteresis)."""
_QUEUED_S, _QUEUE_EASED = 0.12, 0.25
"""Excess delay that indicates a queue [s], and the reduced share of the rate while the queue empties."""
_WINDOW, _ENOUGH, _NEWEST = 200, 20, 4
"""Number of messages for the loss, least number for an estimate, and number for the present delay."""
_KNOWN_S, _ROUND_TRIPS = 5.0, 300
_TICK_S = 0.02
_MARK = struct.Struct(">HHIHIHBB")
"""Mark: sender, number and time of the message [ms]; the answered peer, the time in its newest mark, the time since that
mark arrived [ms]; the measured loss and excess delay."""


@dataclass
class _Peer:
    """State of the other site, from its marks.

    Args:
        heard_s: Arrival time of the newest mark [s].
        sent_ms: Time in that mark, on the other site's clock [ms].
        loss: Loss of this site's streams, as measured there; 1 before the first measurement.
        queued_s: Excess delay of this site's streams, as measured there [s].
        numbers: Newest number on each channel.
        arrived: Arrival of the last messages; each gap is one loss, so that an outage hardly counts.
        ways_ms: Arrival minus sending time of the last messages, on two clocks [ms].
    """

    heard_s: float
    sent_ms: int
    loss: float = 1.0
    queued_s: float = 0.0
    numbers: dict[str, int] = field(default_factory=dict)
    arrived: deque[bool] = field(default_factory=lambda: deque(maxlen=_WINDOW))
    ways_ms: deque[int] = field(default_factory=lambda: deque(maxlen=_WINDOW))

    def count(self, channel: str, number: int, after_silence: bool) -> bool:
        """Count a message, and a gap before it unless that was an outage; return False for an overtaken message."""
        ahead = (number - self.numbers.get(channel, number - 1)) & 0xFFFF
        if not 0 < ahead < 0x8000:
            return False
        self.numbers[channel] = number
        self.arrived.extend((False, True) if ahead > 1 and not after_silence else (True,))
        return True

    @property
    def missed(self) -> float:
        """Loss of the other site's streams; 1 while too few messages have arrived."""
        n = len(self.arrived)
        return self.arrived.count(False) / n if n >= _ENOUGH else 1.0

    @property
    def late_s(self) -> float:
        """Least excess of the last messages' delay over the shortest delay [s]."""
        if not self.ways_ms:
            return 0.0
        return (min(list(self.ways_ms)[-_NEWEST:]) - min(self.ways_ms)) * 1e-3


class StreamPace:
    """Maker and reader of the marks, for any thread.

    Args:
        outage_s: Silence that is an outage, and no loss of single messages [s].
        clock: Returns the time, on a clock that does not go back [s].
    """

    def __init__(self, outage_s: float, clock: Callable[[], float] = time.monotonic):
        self._outage_s, self._clock, self._lock = outage_s, clock, threading.Lock()
        self._me = secrets.randbelow(2**16)
        self._numbers: dict[str, int] = {}
        self._peers: dict[int, _Peer] = {}
        self._newest = 0
        self._round_trips_s: deque[float] = deque(maxlen=_ROUND_TRIPS)
        self._slowed = False

    def mark(self, channel: str) -> bytes:
        """Return the mark of a message that is sent now.

        Args:
            channel: Key of the message's channel.
        """
        with self._lock:
            now_s, peer = self._clock(), self._peers.get(self._newest)
            number = self._numbers[channel] = (self._numbers.get(channel, -1) + 1) & 0xFFFF
            mine = self._me, number, _ms(now_s)
            if peer is None:
                return _MARK.pack(*mine, 0, 0, 0xFFFF, 0, 0)
            held_ms = min(0xFFFF, round(1e3 * (now_s - peer.heard_s)))
            quality = round(255 * peer.missed), min(255, round(peer.late_s / _TICK_S))
            return _MARK.pack(*mine, self._newest, peer.sent_ms, held_ms, *quality)

    def heard(self, channel: str, mark: bytes) -> None:
        """Process the mark of a message of the other site; ignore one of another form.

        Args:
            channel: Key of the message's channel.
            mark: Mark of the message.
        """
        if len(mark) != _MARK.size:
            return
        sender, number, sent_ms, answered, echo_ms, held_ms, loss, late = _MARK.unpack(mark)
        with self._lock:
            now_s = self._clock()
            peer = self._peers.get(sender)
            if peer is None or now_s - peer.heard_s > _KNOWN_S:
                self._peers = {k: p for k, p in self._peers.items() if now_s - p.heard_s <= _KNOWN_S}
                peer = self._peers[sender] = _Peer(now_s, sent_ms)
            if not peer.count(channel, number, now_s - peer.heard_s > self._outage_s):
                return
            peer.heard_s, peer.sent_ms, self._newest = now_s, sent_ms, sender
            peer.ways_ms.append((_ms(now_s) - sent_ms) & 0xFFFFFFFF)
            if answered == self._me and held_ms < 0xFFFF:
                peer.loss, peer.queued_s = loss / 255, late * _TICK_S
                self._round_trips_s.append(max(0.0, ((_ms(now_s) - echo_ms - held_ms) & 0xFFFFFFFF) * 1e-3))

    @property
    def round_trip_s(self) -> float | None:
        """Shortest of the last round trips [s]; None before the first."""
        with self._lock:
            return min(self._round_trips_s, default=None)

    @property
    def rate_bytes_s(self) -> float:
        """Rate for all streams together [B/s]; 0: unlimited."""
        round_trip_s = self.round_trip_s
        with self._lock:
            now_s = self._clock()
            known = [peer for peer in self._peers.values() if now_s - peer.heard_s <= _KNOWN_S]
            loss = max((peer.loss for peer in known), default=0.0)
            is_queued = any(peer.queued_s > _QUEUED_S for peer in known)
            self._slowed = is_queued or loss >= (_HARMLESS if self._slowed else _LOSSY)
            if not self._slowed or not round_trip_s:
                return 0.0
            return (_QUEUE_EASED if is_queued else 1.0) * _LEAST_WINDOW_BYTES / round_trip_s


def _ms(seconds: float) -> int:
    return round(1e3 * seconds) & 0xFFFFFFFF
