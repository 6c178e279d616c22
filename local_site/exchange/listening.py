"""Hearing the robot: each message on its way to the one thread that may handle it."""

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
    """Have messages handled as they come; one that is malformed is dropped and logged.

    Args:
        link: To the robot.
        put: Has something done in the right thread.
        dropped: Takes why a message was not understood.
        channel: Where they come.
        kind: What they are.
        handle: What to do with each.
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
