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
_AT_ONCE, _EACH_S = 32.0, 0.5


class _Flood:
    """Counts what others cause faster than anybody reads: `_AT_ONCE` of a kind, then one each `_EACH_S`.

    A flood would push out of memory and off the disk what matters, and fill a narrow link.
    """

    def __init__(self) -> None:
        self._room: dict[str, tuple[float, float]] = {}  # kind: how many may pass, and when that was so
        self._counted: dict[str, int] = {}

    def passes(self, kind: str, now_s: float) -> bool:
        """Decide whether an event of a kind is told; one that is not is counted."""
        room, then_s = self._room.get(kind, (_AT_ONCE, now_s))
        room = min(_AT_ONCE, room + (now_s - then_s) / _EACH_S)
        self._room[kind] = (room - 1.0 if room >= 1.0 else room), now_s
        if room < 1.0:
            self._counted[kind] = self._counted.get(kind, 0) + 1
        return room >= 1.0

    def with_count(self, kind: str, text: str) -> str:
        """Return the text of an event that passes, with the number of those before it that did not."""
        counted = self._counted.pop(kind, 0)
        return f"{text} (and {counted} more like it)" if counted else text


class Events:
    """The robot's events of this boot. What others cause in a flood is counted, see `_Flood`.

    Args:
        announce: Sends a message to the operators; never blocks.
        now: The present stamp.
        write: Writes an event down; never blocks.
    """

    def __init__(self, announce: Announce, now: Callable[[], Stamp], write: Write):
        self._announce, self._now, self._write = announce, now, write
        self._recent: deque[Event] = deque(maxlen=_KEPT)
        self._seq = 0
        self._flood = _Flood()

    def tell(self, kind: str, text: str, mode: ControlMode, **fields: Any) -> None:
        """Announce, keep and write down what happened."""
        if fields.get("who") and not fields.get("command_id"):  # the end of a command is always told
            if not self._flood.passes(kind, self._now().t_ns * 1e-9):
                return
            text = self._flood.with_count(kind, text)
        self._seq += 1
        event = Event(seq=self._seq, stamp=self._now(), kind=kind, text=text[:500], mode=mode, **fields)
        self._recent.append(event)
        self._announce(keys.EVENT, event)
        self._write(**msgspec.to_builtins(event))

    def refused(self, what: str, who: str, why: str, mode: ControlMode, measured: float | None) -> None:
        """Write a refusal down. Who asked has it in the answer; it is not announced."""
        if not self._flood.passes("refused", self._now().t_ns * 1e-9):
            return
        self._write(
            kind="refused", what=what, who=who, text=self._flood.with_count("refused", why), measured=measured, mode=mode,
            stamp=msgspec.to_builtins(self._now()),
        )  # fmt: skip

    def newest(self, kind: str) -> Event | None:
        """Return the newest event of a kind, as far as it is kept."""
        return next((event for event in reversed(list(self._recent)) if event.kind == kind), None)

    def answer(self, request: EventsRequest) -> EventsReply:
        """The events after a number, the oldest first, as many as fit."""
        later = [event for event in self._recent if event.seq > request.after_seq]
        return EventsReply(events=tuple(later[:_MOST_AT_ONCE]), newest_seq=self._seq, stamp=self._now())
