"""One direction of the relay for UDP datagrams: loss, duplicates, corruption, reordering and delay as the line draws them."""

from __future__ import annotations

import asyncio
import heapq
from collections.abc import Callable
from itertools import count

from farhand.common.impairment.delay_line import LineTime
from farhand.common.impairment.impairment import DirectionSettings
from farhand.common.impairment.message_line import Arrival, MessageLine
from farhand.deploy.link.relay_pipe import Meter

HEADER_BYTES = 28
"""Size of the IPv4 and UDP headers, which take time to send as well [B]."""

Deliver = Callable[[bytes], None]


class DatagramWay:
    """Delay of the datagrams of all flows in one direction. They share rate and queue, as in a modem.

    Args:
        settings: Settings of the direction.
        stream: Name of its random sequences.
        meter: Meter of bytes and lateness.
    """

    def __init__(self, settings: DirectionSettings, stream: str, meter: Meter):
        self._line, self._time, self._meter = MessageLine(settings, stream, is_path=True), LineTime(), meter
        self._loop = asyncio.get_running_loop()
        self._due: list[tuple[float, int, Arrival, bytes, Deliver]] = []  # heap by the line's own time
        self._order = count()
        self._wake: asyncio.TimerHandle | None = None
        self._swallowing = False
        self._tally: dict[str, int] = dict.fromkeys(
            ("taken", "lost", "duplicated", "corrupted", "overflowed", "delivered"), 0
        )

    @property
    def queued_bytes(self) -> int:
        """Bytes held back."""
        return sum(len(data) for _, _, _, data, _ in self._due)

    def report(self) -> dict[str, int]:
        """Return how many datagrams were taken, lost, duplicated, corrupted, dropped by a full queue, and delivered."""
        return dict(self._tally)

    def push(self, data: bytes, deliver: Deliver) -> None:
        """Send a datagram.

        Args:
            data: Content of the datagram.
            deliver: Called with each copy that arrives, as it arrives.
        """
        self._tally["taken"] += 1
        if self._swallowing:
            self._meter.swallowed_bytes += len(data)
            return
        now_s, n_bytes = self._time.on_line(self._loop.time()), len(data) + HEADER_BYTES
        if self._line.free_bytes(now_s) < n_bytes:
            self._tally["overflowed"] += 1
            return
        arrivals = self._line.push(now_s, n_bytes)
        self._tally["lost"] += not arrivals
        self._tally["duplicated"] += len(arrivals) > 1
        for arrival in arrivals:
            self._tally["corrupted"] += arrival.corrupted_at is not None
            heapq.heappush(self._due, (arrival.due_s, next(self._order), arrival, data, deliver))
        self._arm()

    def change(self, settings: DirectionSettings) -> None:
        """Replace the settings for what is sent from now on."""
        self._line.change(settings)

    def stall(self, until_s: float) -> None:
        """Deliver nothing until a time of the event loop [s]; arriving datagrams are queued."""
        self._time.stall(self._loop.time(), until_s)
        self._arm()

    def swallow(self, swallowing: bool) -> None:
        """Begin to drop all held and arriving datagrams, or stop dropping."""
        self._swallowing = swallowing
        if swallowing:
            self._meter.swallowed_bytes += self.queued_bytes
            self.clear()

    def clear(self) -> None:
        """Drop the held datagrams."""
        self._due.clear()
        self._line.clear()
        self._arm()

    def _arm(self) -> None:
        if self._wake is not None:
            self._wake.cancel()
        self._wake = None
        if self._due:
            self._wake = self._loop.call_at(self._time.of_caller(self._due[0][0]), self._deliver)

    def _deliver(self) -> None:
        now_s = self._loop.time()
        while self._due and (due_s := self._time.of_caller(self._due[0][0])) <= now_s:
            _, _, arrival, data, deliver = heapq.heappop(self._due)
            self._meter.forwarded(now_s - due_s)
            self._meter.delivered_bytes += len(data)
            self._tally["delivered"] += 1
            deliver(arrival.received(data))
        self._arm()
