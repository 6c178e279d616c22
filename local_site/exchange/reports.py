"""Reception of the robot's reports: its newest state and path, and every event once.

Events lost in an outage are requested again by their numbers. Each message is handled in the console's thread. Its
age is measured in `farhand.local_site.exchange.report_age`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeVar

from farhand.common.errors import InvalidMessage
from farhand.common.event_loop import Job
from farhand.common.link.interface import Link
from farhand.common.log import loop_logger
from farhand.common.mode_table import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import Event, EventsReply, EventsRequest, Message, PlannedPath, Telemetry
from farhand.local_site.exchange.report_age import LinkMonitor
from farhand.local_site.exchange.requests import Requests

_log = loop_logger(__name__)

_GIVE_UP_S = 60.0


class EventFollower:
    """Follower of the events' numbers. Used by the console's thread alone.

    Args:
        inquiries: Requests to the robot.
        tell: Called with each new event.
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
            # The robot has no older events.
            self._complete_to = max(self._complete_to, reply.events[0].seq - 1)
            self._ahead = {seq for seq in self._ahead if seq > self._complete_to}
            for event in reply.events:
                self.received(event)
            more = reply.events[-1].seq < reply.newest_seq
        self._asking = False
        if more:
            self.catch_up(self._boot)


PLAN_GOOD_S = 60.0
"""Time for which the robot executes a preview [s]."""


class Reports:
    """State of the robot as last reported. Used by the console's thread alone.

    Args:
        monitor: Monitor of the link, which measures the reports.
        events: Follower that requests missed events.
        restarted: Called when the robot was restarted, which invalidates all earlier knowledge of it.
    """

    def __init__(self, monitor: LinkMonitor, events: EventFollower, restarted: Callable[[], None]):
        self._monitor, self._events, self._restarted = monitor, events, restarted
        self.robot: Telemetry | None = None
        self.path: PlannedPath | None = None
        self.path_received_s = 0.0
        self.plan_id = 0
        """Number of the newest valid preview, 0 for none."""
        self.plan_received_s = 0.0
        self._plan_stamp_ns, self._plan_sha256 = 0, ""
        self.other_schema = ""
        """Reason why the newest message was not understood, if the robot has another version; empty otherwise."""

    def on_telemetry(self, report: Telemetry, now_s: float) -> bool:
        """Process a report; return False for one that is older than the newest known."""
        self.other_schema = ""
        was_lost = self._monitor.is_silent(now_s)
        if not self._monitor.received(report, now_s):
            return False
        before, self.robot = self.robot, report
        if before is not None and report.stamp.boot != before.stamp.boot:
            self.forget_plan()
            self._restarted()
        elif _moves(report) and report.stamp.t_ns > self._plan_stamp_ns:
            self.plan_id = 0  # the robot has moved away from the plan's start and would refuse it
        if was_lost or before is None or report.stamp.boot != before.stamp.boot:
            self._events.catch_up(report.stamp.boot)
        return True

    def on_dropped(self, error: InvalidMessage) -> None:
        """Note that a message was not understood."""
        if error.field == "schema":
            self.other_schema = str(error)

    def forget_plan(self) -> None:
        """Forget the preview."""
        self.path, self.plan_id = None, 0

    def expire_plan(self, now_s: float, sha256: str) -> None:
        """Forget a preview that the robot would refuse: too old, or of another model than it has.

        Args:
            now_s: Present time [s].
            sha256: SHA-256 of the model that the robot has confirmed; empty when unknown.
        """
        too_old = now_s - self.plan_received_s > PLAN_GOOD_S
        if self.plan_id and (too_old or sha256 not in ("", self._plan_sha256)):
            self.forget_plan()

    def on_path(self, path: PlannedPath, now_s: float) -> None:
        """Process a path: the robot's committed path, or the requested preview."""
        self.path, self.path_received_s = path, now_s
        if path.plan_id:
            self.plan_id, self.plan_received_s = path.plan_id, now_s
            self._plan_stamp_ns, self._plan_sha256 = path.stamp.t_ns, path.model_sha256


def _moves(robot: Telemetry) -> bool:
    """Decide whether the robot is driven, or moves on its own to another place."""
    return robot.mode is ControlMode.DIRECT or (
        robot.mode is ControlMode.AUTONOMOUS and not robot.phase.at_end
    )


M = TypeVar("M", bound=Message)


def listen(
    link: Link,
    put: Callable[[Job], None],
    dropped: Callable[[InvalidMessage], None],
    channel: Channel,
    kind: type[M],
    handle: Callable[[M], None],
) -> None:
    """Subscribe to a channel; drop and log malformed messages.

    Args:
        link: To the robot.
        put: Queues a job for the handling thread.
        dropped: Called with the reason why a message was not understood.
        channel: Channel of the messages.
        kind: Type of the messages.
        handle: Called with each message.
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
