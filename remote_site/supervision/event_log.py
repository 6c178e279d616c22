"""Events at the robot: announced, kept for sites that missed them, and written to disk."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

import msgspec

from farhand.common.mode_table import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import encode
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import (
    MAX_BYTES,
    Event,
    EventKind,
    EventsReply,
    EventsRequest,
    Message,
    Stamp,
)
from farhand.common.wire.reason_words import sentence
from farhand.common.wire.reasons import N_MORE, Reason

Announce = Callable[[Channel, Message], None]
Write = Callable[..., None]
"""Writes one event to disk, from its fields."""

_KEPT = 256
_MOST_AT_ONCE, _ROOM_FOR_THE_REST = 64, 1024
_AT_ONCE, _EACH_S = 32.0, 0.5


class _Flood:
    """Rate limit of the events that other sites cause: `_AT_ONCE` of a kind, then one each `_EACH_S`.

    A flood would displace the events that matter from memory and disk, and fill a narrow link.
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

    def with_count(self, kind: str, reason: Reason) -> Reason:
        """Return the reason of an event that passes, with the number of those held back before it."""
        counted = self._counted.pop(kind, 0)
        return reason.with_value(N_MORE, counted) if counted else reason


class Events:
    """Robot's events of this boot, those caused by other sites limited in their rate.

    Args:
        announce: Sends a message to the operators; never blocks.
        now: The present stamp.
        write: Writes an event to disk; never blocks.
    """

    def __init__(self, announce: Announce, now: Callable[[], Stamp], write: Write):
        self._announce, self._now, self._write = announce, now, write
        self._recent: deque[Event] = deque(maxlen=_KEPT)
        self._seq = 0
        self._flood = _Flood()

    def tell(self, kind: EventKind, reason: Reason, mode: ControlMode, **fields: Any) -> None:
        """Announce an event, keep it and write it to disk."""
        if fields.get("who") and not fields.get("command_id"):  # the end of a command is always told
            if not self._flood.passes(kind, self._now().t_ns * 1e-9):
                return
            reason = self._flood.with_count(kind, reason)
        self._seq += 1
        event = Event(seq=self._seq, stamp=self._now(), kind=kind, reason=reason, mode=mode, **fields)
        self._recent.append(event)
        self._announce(keys.EVENT, event)
        self._write(
            **msgspec.to_builtins(event), text=sentence(event.reason, event.cause), measured=event.measured
        )  # fmt: skip

    def refused(self, what: str, who: str, why: Reason | None, mode: ControlMode) -> None:
        """Write a refusal to disk. It is not announced: the asking site gets it as its answer."""
        if why is None or not self._flood.passes("refused", self._now().t_ns * 1e-9):
            return
        why = self._flood.with_count("refused", why)
        self._write(
            kind="refused", what=what, who=who, reason=msgspec.to_builtins(why), text=sentence(why),
            measured=why.measured, mode=mode, stamp=msgspec.to_builtins(self._now()),
        )  # fmt: skip

    def newest(self, kind: str) -> Event | None:
        """Return the newest kept event of a kind; None for none."""
        return next((event for event in reversed(list(self._recent)) if event.kind == kind), None)

    def answer(self, request: EventsRequest) -> EventsReply:
        """Return the events after a number, the oldest first, as many as fit into one message."""
        fitting, room = list[Event](), MAX_BYTES - _ROOM_FOR_THE_REST
        for event in self._recent:
            if event.seq <= request.after_seq:
                continue
            room -= len(encode(event))
            if room < 0 or len(fitting) == _MOST_AT_ONCE:
                break
            fitting.append(event)
        return EventsReply(events=tuple(fitting), newest_seq=self._seq, stamp=self._now())
