"""What happened at the robot: announced, kept for who missed it, and written down."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

import msgspec

from farhand.common.control_mode import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import Event, EventsReply, EventsRequest, Message, Stamp

Announce = Callable[[Channel, Message], None]
Write = Callable[..., None]
"""Writes one event down, from its fields."""

_KEPT = 256
_MOST_AT_ONCE = 64


class Events:
    """The robot's events of this boot.

    Args:
        announce: Sends a message to the operators; never blocks.
        now: The present stamp.
        write: Writes an event down; never blocks.
    """

    def __init__(self, announce: Announce, now: Callable[[], Stamp], write: Write):
        self._announce, self._now, self._write = announce, now, write
        self._recent: deque[Event] = deque(maxlen=_KEPT)
        self._seq = 0

    def tell(self, kind: str, text: str, mode: ControlMode, **fields: Any) -> None:
        """Announce, keep and write down what happened."""
        self._seq += 1
        event = Event(seq=self._seq, stamp=self._now(), kind=kind, text=text[:500], mode=mode, **fields)
        self._recent.append(event)
        self._announce(keys.EVENT, event)
        self._write(**msgspec.to_builtins(event))

    def refused(self, what: str, who: str, why: str, mode: ControlMode, measured: float | None) -> None:
        """Write a refusal down. Who asked has it in the answer; it is not announced."""
        self._write(
            kind="refused", what=what, who=who, text=why, measured=measured, mode=mode,
            stamp=msgspec.to_builtins(self._now()),
        )  # fmt: skip

    def newest(self, kind: str) -> Event | None:
        """Return the newest event of a kind, as far as it is kept."""
        return next((event for event in reversed(list(self._recent)) if event.kind == kind), None)

    def answer(self, request: EventsRequest) -> EventsReply:
        """The events after a number, the oldest first, as many as fit."""
        later = [event for event in self._recent if event.seq > request.after_seq]
        return EventsReply(events=tuple(later[:_MOST_AT_ONCE]), newest_seq=self._seq, stamp=self._now())
