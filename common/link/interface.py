"""Interface of a link between the two sites, common to the real and the virtual one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from farhand.common.wire.keys import Channel


class Signed(bytes):
    """Bytes of a site whose name is bound to its certificate.

    Args:
        data: The bytes.
        site: Name of the site.
    """

    site: str

    def __new__(cls, data: bytes, site: str) -> Signed:
        """Return the bytes with the name."""
        signed = super().__new__(cls, data)
        signed.site = site
        return signed


def site_of(data: bytes) -> str:
    """Return the name of the site that has sent these bytes; empty where no certificate tells it."""
    return data.site if isinstance(data, Signed) else ""


Deliver = Callable[[bytes], bool | None]
"""Receiver of a message; never blocks. It returns False for an unwanted message, whose sender must slow down."""
Answered = Callable[[bytes | None], None]


class Request(Protocol):
    """Question of the other site that waits for its answer."""

    @property
    def data(self) -> bytes:
        """The question; `Signed` where a certificate tells who asks."""
        ...

    def answer(self, data: bytes) -> None:
        """Answer the question, from any thread, without blocking."""
        ...


Handle = Callable[[Request], bool | None]
"""Receiver of a question, like `Deliver`."""


class Link(Protocol):
    """Interface of a site's connection."""

    def send(self, channel: Channel, data: bytes) -> None:
        """Hand a message over for sending; never blocks, and gives no information about its arrival."""
        ...

    def subscribe(self, channel: Channel, deliver: Deliver) -> None:
        """Register the receiver of a channel's messages, called in the thread that reads the connection.

        After an outage, while fresh connections take the place of the old ones, a message may arrive on both.
        """
        ...

    def serve(self, channel: Channel, handle: Handle) -> None:
        """Register the receiver of a channel's questions, called in the same way."""
        ...

    def limit(self, channel: Channel, bytes_per_s: float) -> None:
        """Set the byte budget of a newest-only channel [B/s]; messages beyond it are skipped, not queued."""
        ...

    def ask(self, channel: Channel, data: bytes, timeout_s: float, answered: Answered) -> None:
        """Ask the other site; never blocks.

        Args:
            channel: Channel of the question.
            data: The question.
            timeout_s: Time-out [s].
            answered: Called at most once, from a thread of the link's own, and must not block. None: no
                answer came, and the question may not have been delivered. A link that is closed before may
                not call it.
        """
        ...

    def close(self) -> None:
        """End the connection and all its threads."""
        ...
