"""In-process link in virtual time: each message may be late, lost, duplicated, corrupted or reordered.

Both ends offer the protocol `farhand.common.link.interface.Link`. Retransmission, order and the handshake
of Zenoh and TCP are not modelled: this link is worse than theirs, and says nothing about their timing.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from functools import partial
from itertools import count

from farhand.common.clock import VirtualTime
from farhand.common.impairment.impairment import LinkSettings
from farhand.common.impairment.virtual_direction import OneWay, Packet, PacketKind
from farhand.common.link.interface import Answered, Deliver, Request
from farhand.common.wire.keys import Channel


class _VirtualRequest:
    def __init__(self, question: Packet, answer: Callable[[Packet, bytes], None]):
        self._question, self._answer = question, answer
        self.data = question.data

    def answer(self, data: bytes) -> None:
        self._answer(self._question, data)


class VirtualEnd:
    """One site's end of the link; a `Link`.

    Args:
        time: The time.
        out: Direction to the other site.
        back: Direction from the other site; a new end takes it over from the previous one.
    """

    _numbers = count(1)  # over all ends: no answer to a previous end may pass for one to this

    def __init__(self, time: VirtualTime, out: OneWay, back: OneWay):
        self._time, self._out = time, out
        self._subscribers: dict[Channel, list[Deliver]] = defaultdict(list)
        self._servers: dict[Channel, Callable[[Request], bool | None]] = {}
        self._asking: dict[int, Answered] = {}
        self._closed = False
        back.receiver = self._receive

    def send(self, channel: Channel, data: bytes) -> None:
        """See `Link.send`."""
        self._put(Packet(PacketKind.PUT, channel, data, self._time.now_s()))

    def subscribe(self, channel: Channel, deliver: Deliver) -> None:
        """See `Link.subscribe`."""
        self._subscribers[channel].append(deliver)

    def serve(self, channel: Channel, handle: Callable[[Request], bool | None]) -> None:
        """See `Link.serve`."""
        self._servers[channel] = handle

    def limit(self, channel: Channel, bytes_per_s: float) -> None:
        """See `Link.limit`."""
        self._out.limit(channel, bytes_per_s)

    def ask(self, channel: Channel, data: bytes, timeout_s: float, answered: Answered) -> None:
        """See `Link.ask`. While the link is cut, or without a server, the answer is None at once."""
        number = next(self._numbers)
        self._asking[number] = answered
        self._time.call_later(timeout_s if self._out.up else 0.0, partial(self._end, number, None))
        self._put(Packet(PacketKind.QUESTION, channel, data, self._time.now_s(), number))

    def close(self) -> None:
        """See `Link.close`."""
        self._closed = True
        self._asking.clear()

    def _put(self, packet: Packet) -> None:
        if not self._closed:
            self._out.submit(packet)

    def _receive(self, packet: Packet) -> None:
        if self._closed:
            return
        if packet.kind is PacketKind.PUT:
            for deliver in self._subscribers[packet.channel]:
                deliver(packet.data)
        elif packet.kind is PacketKind.ANSWER:
            self._end(packet.number, packet.data)
        elif (handle := self._servers.get(packet.channel)) is not None:
            handle(_VirtualRequest(packet, self._answer))

    def _answer(self, question: Packet, data: bytes) -> None:
        self._put(Packet(PacketKind.ANSWER, question.channel, data, self._time.now_s(), question.number))

    def _end(self, number: int, data: bytes | None) -> None:
        if (answered := self._asking.pop(number, None)) is not None:
            answered(data)


class VirtualLink:
    """Both directions between the sites. Nothing is connected until the ends are made.

    Args:
        time: The time.
        settings: First settings of both directions.
    """

    def __init__(self, time: VirtualTime, settings: LinkSettings):
        self._time = time
        self.uplink = OneWay(time, settings.uplink, "uplink")
        self.downlink = OneWay(time, settings.downlink, "downlink")

    def local_end(self) -> VirtualEnd:
        """Open a new end at the operator's site and close the previous one."""
        return VirtualEnd(self._time, self.uplink, self.downlink)

    def remote_end(self) -> VirtualEnd:
        """Open a new end at the robot's site and close the previous one."""
        return VirtualEnd(self._time, self.downlink, self.uplink)

    def change(self, settings: LinkSettings) -> None:
        """Replace the settings for later messages."""
        self.uplink.change(settings.uplink)
        self.downlink.change(settings.downlink)

    def cut(self) -> None:
        """Lose everything in transit and let nothing through, like an outage with a reset."""
        for way in (self.uplink, self.downlink):
            way.cut()

    def mend(self) -> None:
        """Let later messages through again."""
        for way in (self.uplink, self.downlink):
            way.up = True

    def stall(self, duration_s: float) -> None:
        """Hold everything for a duration [s], then deliver all of it at once."""
        for way in (self.uplink, self.downlink):
            way.hold(self._time.now_s() + duration_s)

    def swallow(self, duration_s: float) -> None:
        """Deliver nothing for a duration [s], unnoticed by the senders, then lose all of it."""
        self._time.call_later(duration_s, self._lose_all)  # before held messages are due at the same moment
        self.stall(duration_s)

    def _lose_all(self) -> None:
        self.cut()
        self.mend()
