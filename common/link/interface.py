"""Interface of a link between the two sites, by which a real and a virtual one are the same to both."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from farhand.common.wire.keys import Channel

Deliver = Callable[[bytes], bool | None]
"""Takes a message, without blocking; returns False when it was not wanted: its sender must slow down."""
Answered = Callable[[bytes | None], None]


class Request(Protocol):
    """Question of the other site that waits for its answer."""

    @property
    def data(self) -> bytes:
        """The question."""
        ...

    def answer(self, data: bytes) -> None:
        """Answer it, from any thread, without blocking."""
        ...


Handle = Callable[[Request], bool | None]
"""The same for a question."""


class Link(Protocol):
    """Interface of a site's connection."""

    def send(self, channel: Channel, data: bytes) -> None:
        """Hand a message over for sending; never blocks, and gives no information about its arrival."""
        ...

    def subscribe(self, channel: Channel, deliver: Deliver) -> None:
        """Have each message of a channel delivered, from the thread that reads its connection."""
        ...

    def serve(self, channel: Channel, handle: Handle) -> None:
        """Have each question on a channel handed over in the same way."""
        ...

    def limit(self, channel: Channel, bytes_per_s: float) -> None:
        """Give a newest-only channel a byte budget [B/s]; messages beyond it are skipped, not queued."""
        ...

    def ask(self, channel: Channel, data: bytes, timeout_s: float, answered: Answered) -> None:
        """Ask the other site; never blocks.

        Args:
            channel: Channel on which it is served.
            data: The question.
            timeout_s: Time-out [s].
            answered: Called at most once, from a thread of the link's own, and must not block. None: no
                answer came, and perhaps the question was not delivered. A link that is closed before may
                not call it.
        """
        ...

    def close(self) -> None:
        """End the connection and all its threads."""
        ...
