"""Reception of the robot's messages, each on its way to the one thread that may handle it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeVar

from farhand.common.errors import InvalidMessage
from farhand.common.event_loop import Job
from farhand.common.link.link import Link
from farhand.common.log import loop_logger
from farhand.common.wire.codec import decode
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import Message

_log = loop_logger(__name__)
M = TypeVar("M", bound=Message)


def listen(
    link: Link,
    put: Callable[[Job], None],
    dropped: Callable[[InvalidMessage], None],
    channel: Channel,
    kind: type[M],
    handle: Callable[[M], None],
) -> None:
    """Have messages handled as they come; drop and log malformed ones.

    Args:
        link: To the robot.
        put: Has a function called in the right thread.
        dropped: Takes the reason why a message was not understood.
        channel: Channel of the messages.
        kind: Type of the messages.
        handle: Handles each message.
    """

    def deliver(data: bytes) -> None:
        try:
            message = decode(data, kind)
        except InvalidMessage as error:
            _log.warning("dropped: %s", error)
            put(partial(dropped, error))
        else:
            put(partial(handle, message))

    link.subscribe(channel, deliver)
