"""One direction of a link in virtual time: its queues, the packets in transit, and their arrivals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from functools import partial

from farhand.common.clock import VirtualTime
from farhand.common.impairment.impairment import DirectionSettings
from farhand.common.impairment.message_line import MessageLine
from farhand.common.link.budget import OVERHEAD_BYTES
from farhand.common.link.outbox import SendQueue
from farhand.common.wire.keys import Channel, Urgency


class PacketKind(Enum):
    """Kind of a packet."""

    PUT = auto()
    QUESTION = auto()
    ANSWER = auto()


@dataclass(frozen=True)
class Packet:
    """Message in transit.

    Args:
        kind: Kind of the packet.
        channel: Channel of the message.
        data: Content of the message.
        sent_s: Time when it was handed over [s].
        number: Number of the question that it asks or answers.
    """

    kind: PacketKind
    channel: Channel
    data: bytes
    sent_s: float
    number: int = 0


Tap = Callable[[Packet], None]


class OneWay:
    """One direction of the link.

    Args:
        time: The time.
        settings: Impairment of the direction.
        name: Name of its random sequences.
    """

    def __init__(self, time: VirtualTime, settings: DirectionSettings, name: str):
        self._time = time
        self._line = MessageLine(settings, name)
        self._queues: dict[Urgency, SendQueue[Packet]] = {urgency: SendQueue() for urgency in Urgency}
        self._wake_s: float | None = None
        self._epoch = 0
        self._held_until_s = 0.0
        self.up = True
        """True unless the direction is cut."""
        self.receiver: Tap = lambda packet: None
        self.tap: Tap = lambda packet: None
        """Sees each packet that arrives, before its receiver."""

    def submit(self, packet: Packet) -> None:
        """Send a packet as soon as there is room; drop it while the direction is cut."""
        if self.up:
            newest_only = None if packet.channel.must_arrive else packet.channel.key
            self._queues[packet.channel.urgency].put(packet, newest_only, len(packet.data) + OVERHEAD_BYTES)
            self._flush()

    def limit(self, channel: Channel, bytes_per_s: float) -> None:
        """See `Link.limit`."""
        self._queues[channel.urgency].limit(channel.key, bytes_per_s)

    def change(self, settings: DirectionSettings) -> None:
        """Replace the settings for later messages."""
        self._line.change(settings)
        self._flush()

    def cut(self) -> None:
        """Lose everything that waits or is in transit, and accept nothing more."""
        self.up = False
        self._epoch += 1
        self._line.clear()
        for queue in self._queues.values():
            queue.clear()

    def hold(self, until_s: float) -> None:
        """Deliver nothing before a time [s]; then everything held arrives at once."""
        self._held_until_s = until_s

    def deliver(self, packet: Packet) -> None:
        """Deliver a packet now."""
        self.tap(packet)
        self.receiver(packet)

    def _flush(self) -> None:
        now_s = self._time.now_s()
        while self.up and self._line.free_bytes(now_s) > 0:
            packet = next(filter(None, (queue.take(now_s) for queue in self._queues.values())), None)
            if packet is None:
                break
            for arrival in self._line.push(now_s, len(packet.data) + OVERHEAD_BYTES):
                if arrival.corrupted_at is None:  # the transport drops packets with a wrong checksum
                    self._time.call_at(arrival.due_s, partial(self._arrive, packet, self._epoch))
        self._wake_when_possible(now_s)

    def _wake_when_possible(self, now_s: float) -> None:
        waits_s = [
            wait_s for queue in self._queues.values() if (wait_s := queue.ready_in_s(now_s)) is not None
        ]
        if not waits_s:
            return
        wake_s = now_s + min(waits_s)
        if self._line.free_bytes(now_s) <= 0 and (room_s := self._line.next_arrival_s) is not None:
            wake_s = max(wake_s, room_s)
        if self._wake_s is None or wake_s < self._wake_s:
            self._wake_s = wake_s
            self._time.call_at(wake_s, partial(self._wake, wake_s))

    def _wake(self, planned_s: float) -> None:
        if self._wake_s == planned_s:
            self._wake_s = None
            self._flush()

    def _arrive(self, packet: Packet, epoch: int) -> None:
        if epoch != self._epoch:
            return
        if self._time.now_s() < self._held_until_s:
            self._time.call_at(self._held_until_s, partial(self._arrive, packet, epoch))
        else:
            self.deliver(packet)
