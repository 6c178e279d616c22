"""Delivery over QUIC by kind of message: streams at a rate that the connection carries, urgent messages in two ways.

Over TCP the transport delivers all messages in order, however late, so none of this applies.
"""

from __future__ import annotations

import math
import secrets
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import zenoh

from farhand.common.link.budget import OVERHEAD_BYTES, Silence, SilenceGate
from farhand.common.link.pace import SHARES, StreamPace
from farhand.common.link.questions import ID_BYTES, Copies, Question
from farhand.common.wire import keys
from farhand.common.wire.keys import Channel

_CHANGE = 0.1
"""Relative change of the rate that updates the budgets of the streams."""
_SENT_KEPT = 64
ASKER_BYTES = 8
_GAP_KEPT_S = 10.0
"""Time for which a gap between reports counts [s]: as long as the robot takes for learning the usual age of a message."""

Put = Callable[[Channel, bytes, bool, bytes | None], None]
"""Puts a message on a channel: reliably or as a datagram, with an attachment."""


class QuicDelivery:
    """Delivery of one site's messages.

    Args:
        silence: Silence of the other site.
        put: Puts a message now, in the channel's sending thread.
        limit: Sets the budget of a streamed channel [B/s]; zero removes it.
    """

    def __init__(self, silence: Silence, put: Put, limit: Callable[[Channel, float], None]):
        self._put, self._limit, self._silence = put, limit, silence
        self._gate, self._pace, self._copies = SilenceGate(silence), StreamPace(silence.outage_s), Copies()
        self._paced_bytes_s = self._next_report_s = 0.0
        self._gap_s, self._gap_since_s = 0.0, -math.inf
        self._streamed_s: float | None = None
        self._sent: dict[Channel, deque[bytes]] = {}
        self.asker = secrets.token_hex(ASKER_BYTES)
        """Random name of this process, in the key of the answers to its questions."""

    @property
    def streams_silent_s(self) -> float:
        """Time since the last message of a stream [s]; 0 before the first: the streams' connection may be stuck alone."""
        return time.monotonic() - self._streamed_s if self._streamed_s is not None else 0.0

    def lets_out(self, channel: Channel, n_bytes: int) -> bool:
        """Decide whether a message may be sent now; otherwise it is skipped.

        Args:
            channel: Channel of the message.
            n_bytes: Size of the message, with the transport's own bytes [B].
        """
        if channel.must_arrive and channel is not keys.STOP:
            return True
        if channel is keys.TELEMETRY and (rate := SHARES[channel] * self._paced_bytes_s):
            # The next report follows soon: a fresh one then is better than this one sent late.
            now_s = time.monotonic()
            if now_s < self._next_report_s:
                return False
            self._next_report_s = now_s + n_bytes / rate
            if n_bytes / rate >= self.report_gap_s:
                self._gap_s, self._gap_since_s = n_bytes / rate, now_s
        return self._gate.lets_out(channel, n_bytes)

    @property
    def report_gap_s(self) -> float:
        """Longest time between two reports during the last seconds [s]; 0 while all of them leave at once."""
        return self._gap_s if time.monotonic() - self._gap_since_s < _GAP_KEPT_S else 0.0

    def send(self, channel: Channel, data: bytes) -> None:
        """Send a message now, according to its kind."""
        if channel.is_streamed:
            if not self._silence.is_unusual:
                self._put(channel, data, False, self._pace.mark(channel.key))
            else:  # without a mark, as each byte counts, and a report where there is room
                self._put(self._gate.reports if channel is keys.TELEMETRY else channel, data, False, None)
        elif channel.both_ways:
            try:
                self._put(channel, data, False, None)
            finally:  # the reliable copy of a stop has another connection
                sent = self._sent.setdefault(channel, deque(maxlen=_SENT_KEPT))
                if data not in sent:  # its sender repeats it; one reliable copy is enough
                    sent.append(data)
                    self._put(channel, data, True, None)
        else:
            self._put(channel, data, True, None)

    def arrived(self, channel: Channel, sample: zenoh.Sample) -> None:
        """Process the mark of a sample, and set the rate of the streams by it."""
        if not channel.is_streamed or channel in keys.REPORTS[1:]:
            return
        self._streamed_s = time.monotonic()
        if sample.attachment is None:
            return
        self._pace.heard(channel.key, sample.attachment.to_bytes())
        rate = self._pace.rate_bytes_s
        if abs(rate - self._paced_bytes_s) > _CHANGE * max(rate, self._paced_bytes_s):
            self._paced_bytes_s = rate
            for stream, share in SHARES.items():
                if stream is not keys.TELEMETRY:
                    self._limit(stream, share * rate)

    def lets_ask(self, channel: Channel) -> bool:
        """Decide whether a question may be asked now: a question each second would fill the window during an outage.

        Args:
            channel: Channel of the question.
        """
        return channel is not keys.LEASE or self._gate.lets_out(channel, OVERHEAD_BYTES)

    def ask(self, question: Question, submit: Callable[[], None]) -> None:
        """Send copies of a question until it is answered; none while the other site is silent.

        Args:
            question: The question.
            submit: Queues one copy for sending; never blocks.
        """
        self._copies.add(question, lambda: None if self._silence.is_unusual else submit())

    def copy_attachment(self, question: Question) -> bytes:
        """Return the attachment of every copy of a question."""
        return question.id + self.asker.encode()

    def answered(self, sample: zenoh.Sample) -> None:
        """Process an answer to a copy."""
        self._silence.heard()
        if sample.attachment is not None:
            self._copies.answered(sample.attachment.to_bytes(), sample.payload.to_bytes())

    def close(self) -> None:
        """End the thread."""
        self._copies.close()


def copy_of(item: zenoh.Query | zenoh.Sample) -> tuple[bytes, str] | None:
    """Return the question's id and the asking process of a copy; None for any other item."""
    attachment: Any = item.attachment
    if attachment is None or len(attachment) != ID_BYTES + 2 * ASKER_BYTES:
        return None
    data = attachment.to_bytes()
    asker = data[ID_BYTES:].decode("ascii", "replace")
    return (data[:ID_BYTES], asker) if asker.isalnum() and asker.isascii() else None


def site_in(item: zenoh.Query | zenoh.Sample) -> str:
    """Return the name of the site in the key of what it sent."""
    return str(item.key_expr).split("/")[1]
