"""A `Link` inside one process: both ends deliver at once, in the sender's thread, as long as it is up."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable

from farhand.common.link.interface import Answered, Deliver, Request
from farhand.common.wire.keys import Channel


class Question:
    """One that waits for its answer."""

    def __init__(self, data: bytes, answered: Answered):
        self.data = data
        self._answered = answered

    def answer(self, data: bytes) -> None:
        self._answered(data)


class Loopback:
    """One end. `pair` makes both."""

    def __init__(self) -> None:
        self.other = self
        self.up = True
        self.sent: list[tuple[Channel, bytes]] = []
        """All that was handed over here, delivered or not."""
        self._subscribers: dict[Channel, list[Deliver]] = defaultdict(list)
        self._servers: dict[Channel, Callable[[Request], bool | None]] = {}

    @classmethod
    def pair(cls) -> tuple[Loopback, Loopback]:
        one, other = cls(), cls()
        one.other, other.other = other, one
        return one, other

    def cut(self) -> None:
        """Nothing gets through any more, in either direction."""
        self.up = self.other.up = False

    def mend(self) -> None:
        self.up = self.other.up = True

    def send(self, channel: Channel, data: bytes) -> None:
        self.sent.append((channel, data))
        if self.up:
            for deliver in self.other._subscribers[channel]:
                deliver(data)

    def subscribe(self, channel: Channel, deliver: Deliver) -> None:
        self._subscribers[channel].append(deliver)

    def serve(self, channel: Channel, handle: Callable[[Request], bool | None]) -> None:
        self._servers[channel] = handle

    def ask(self, channel: Channel, data: bytes, timeout_s: float, answered: Answered) -> None:
        handle = self.other._servers.get(channel)
        if handle is None or not self.up:
            answered(None)
        else:
            handle(Question(data, answered))

    def limit(self, channel: Channel, bytes_per_s: float) -> None:
        """Everything arrives at once: there is nothing to save."""

    def close(self) -> None:
        self.cut()
