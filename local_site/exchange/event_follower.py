"""Follower of the robot's events: tells each once, and requests those that an outage has swallowed."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from farhand.common.wire import keys
from farhand.common.wire.messages import Event, EventsReply, EventsRequest
from farhand.local_site.exchange.requests import Requests

_GIVE_UP_S = 60.0


class EventFollower:
    """Follower of the events' numbers. Used by the console's thread alone.

    Args:
        inquiries: Asks the robot.
        tell: Takes each new event.
    """

    def __init__(self, inquiries: Requests, tell: Callable[[Event], None]):
        self._inquiries, self._tell = inquiries, tell
        self._boot = ""
        self._complete_to = 0
        """All events up to this number were told."""
        self._ahead: set[int] = set()
        self._asking = False

    def received(self, event: Event) -> None:
        """Process an event that the robot announced."""
        if event.stamp.boot != self._boot:
            self._begin(event.stamp.boot)
        if event.seq <= self._complete_to or event.seq in self._ahead:
            return
        self._ahead.add(event.seq)
        self._tell(event)
        while self._complete_to + 1 in self._ahead:
            self._complete_to += 1
            self._ahead.remove(self._complete_to)
        if self._ahead:
            self.catch_up(self._boot)

    def catch_up(self, boot: str) -> None:
        """Request events that may have been missed: after a gap in the numbers, and after every outage.

        Args:
            boot: Present boot of the robot.
        """
        if boot != self._boot:
            self._begin(boot)
        if not self._asking:
            self._asking = True
            request = EventsRequest(after_seq=self._complete_to)
            answered = partial(self._on_reply, boot)
            self._inquiries.ask(keys.EVENTS, request, EventsReply, _GIVE_UP_S, answered)

    def _begin(self, boot: str) -> None:
        self._boot, self._complete_to = boot, 0
        self._ahead.clear()

    def _on_reply(self, asked_boot: str, reply: EventsReply | None, _took_s: float) -> None:
        more = asked_boot != self._boot  # the robot restarted meanwhile: its numbers began again
        if reply is not None and reply.stamp.boot == asked_boot == self._boot and reply.events:
            # The robot keeps no older ones.
            self._complete_to = max(self._complete_to, reply.events[0].seq - 1)
            self._ahead = {seq for seq in self._ahead if seq > self._complete_to}
            for event in reply.events:
                self.received(event)
            more = reply.events[-1].seq < reply.newest_seq
        self._asking = False
        if more:
            self.catch_up(self._boot)
