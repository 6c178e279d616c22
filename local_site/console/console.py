"""Operator's console: every intent and report goes through one queue with one owner, except STOP, which is sent at once.

The console shows only the reported state of the robot, never an expected one: an action is pending until the robot's
report settles it.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from farhand.common.clock import SuspendWatch, elapsed_s
from farhand.common.event_loop import EventLoop
from farhand.common.json_lines import JsonLinesFile
from farhand.common.link.budget import limit_flows
from farhand.common.link.interface import Link
from farhand.common.mode_table import Action
from farhand.common.wire import keys
from farhand.common.wire.messages import (
    CameraPicture,
    Event,
    ExecutionReport,
    PlannedPath,
    ReportRequest,
    Telemetry,
    Wish,
)
from farhand.common.wire.reasons import Code, Reason
from farhand.local_site.console import intents
from farhand.local_site.console.catalogue import RobotCatalogue
from farhand.local_site.console.commanding import Commanding
from farhand.local_site.console.console_parts import ConsoleParts
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.console.dispatcher import Dispatcher
from farhand.local_site.console.executions import ExecutionHistory
from farhand.local_site.console.sending import Sending
from farhand.local_site.console.teaching import Teaching
from farhand.local_site.console.teleoperation import Teleoperation
from farhand.local_site.exchange.camera import CameraWatch
from farhand.local_site.exchange.fetching import KnownScenes
from farhand.local_site.exchange.model_sender import ModelSender
from farhand.local_site.exchange.notices import Notice, Notices
from farhand.local_site.exchange.report_age import LinkMonitor
from farhand.local_site.exchange.reports import EventFollower, Reports, listen
from farhand.local_site.exchange.requests import Requests
from farhand.local_site.exchange.stop_sender import StopLane
from farhand.local_site.teaching.library import Library
from farhand.local_site.workcell.workcell import Workcell, make_workcell

_SERVED_S = 1.0
PERIOD_S = 0.05
"""Time from one tick to the next [s]."""


class Console:
    """Owner of the site's state, and sender of its requests.

    Args:
        library: Lessons of all tasks.
        link: To the robot.
        site_name: Name of this site.
        log: Keeps the log of events; None keeps it in memory alone.
        wish: Whether this site takes the control of the robot when it is free, or only watches.
        now_s: Clock of this site [s].
        rate_bps: Capacity of the link [bit/s]; 0 for more than enough.
        place: Workcell of the operator; None to make the one that the tasks need.
        known: Drawings of robots that need not be fetched; None if the robot is not drawn.
    """

    def __init__(
        self,
        library: Library,
        link: Link,
        site_name: str,
        log: JsonLinesFile | None = None,
        wish: Wish = Wish.CONTROL,
        now_s: Callable[[], float] = elapsed_s,
        rate_bps: float = 0.0,
        place: Workcell | None = None,
        known: KnownScenes | None = None,
    ):
        self._library, self._link, self._now_s = library, link, now_s
        self.rate_bps = rate_bps
        """Capacity of the link, as it was told at the start [bit/s]; 0 for more than enough."""
        self.owner = EventLoop("console", PERIOD_S, self._tick, self._redraw, now_s)
        """Runs everything here, one call after the other."""
        self._notices, monitor = Notices(log), LinkMonitor()
        self._inquiries = Requests(link, self.owner.put, now_s)
        self._commanding = Commanding(
            link,
            self._inquiries,
            monitor,
            site_name,
            self._notices.add,
            wish,
            self._on_model_lost,
        )
        self._models = ModelSender(self._inquiries, now_s, self._commanding.session, rate_bps)
        self._events = EventFollower(self._inquiries, self._on_event)
        self._reports = Reports(monitor, self._events, self._on_restart)
        self._executions = ExecutionHistory(self._inquiries, library)
        self._camera = CameraWatch(self._inquiries, monitor, self._commanding.session, now_s)
        self._place = place or make_workcell(library.task)
        self._catalogue = RobotCatalogue(self._inquiries, library, site_name, self._tell, rate_bps, known)
        self._teaching = Teaching(library, self._place, self._tell)
        self._sending = Sending(library, self._models, self._tell)
        self._stop = StopLane(link, site_name, now_s)
        self._suspend = SuspendWatch()
        limit_flows(link, rate_bps)
        self._parts = ConsoleParts(
            library, self._place, self._catalogue, self._teaching, self._sending, self._models, self._commanding,
            self._stop, self._reports, self._executions, self._camera, monitor, self._notices,
        )  # fmt: skip
        self._dispatcher = Dispatcher(self._parts, Teleoperation(link), now_s)
        self._changed = threading.Condition()
        self._drawn = self._parts.draw(now_s())

    @property
    def picture(self) -> ConsoleState:
        """Complete present state; the newest stop is current even while the console is busy."""
        drawn, stop = self._drawn, self._stop.status
        return drawn if drawn.stop is stop else replace(drawn, stop=stop)

    # From other threads -------------------------------------------------------------------------

    def start(self) -> None:
        """Listen to the robot and begin, in a thread."""
        self.listen()
        self._stop.start()
        self.owner.start()

    def listen(self) -> None:
        """Listen to the robot. Without `start`, in virtual time, the caller runs the queue."""
        self._stop.listen()
        hear = partial(listen, self._link, self.owner.put, self._reports.on_dropped)
        hear(keys.TELEMETRY, Telemetry, self._on_telemetry)
        hear(keys.EVENT, Event, self._events.received)
        hear(keys.PATH, PlannedPath, lambda path: self._reports.on_path(path, self._now_s()))
        hear(keys.PICTURE, CameraPicture, self._camera.on_picture)
        self._place.start(self.owner.put, self._library.on_moved)

    def close(self) -> None:
        """End the console; unsent messages are dropped."""
        self._stop.close()
        self._place.close()
        self.owner.close()
        self._inquiries.close()

    def submit(self, intent: intents.Intent) -> None:
        """Submit an intent. Returns at once; the picture shows the outcome.

        A stop is on its way when this returns, whatever the console is busy with.
        """
        if isinstance(intent, intents.CommandRobot) and intent.action is Action.STOP:
            self._stop.press()
        self.owner.put(partial(self._dispatcher.do, intent))

    def ask_report(self, timeout_s: float = 15.0) -> ExecutionReport | None:
        """Ask the robot for the report of its newest execution, and wait. Return None without an answer."""
        answers: queue.SimpleQueue[ExecutionReport | None] = queue.SimpleQueue()
        self.request_report(answers.put)
        try:
            return answers.get(timeout=timeout_s)
        except queue.Empty:
            return None

    def request_report(self, answered: Callable[[ExecutionReport | None], None]) -> None:
        """Ask the robot for the report of its newest execution; return at once.

        Args:
            answered: Called once, in the console's thread; with None when no answer came.
        """
        ask = partial(self._inquiries.ask, keys.REPORT, ReportRequest(), ExecutionReport, 0.0)
        self.owner.put(partial(ask, lambda answer, _took_s: answered(answer)))

    def wait_for(self, holds: Callable[[ConsoleState], bool], timeout_s: float | None) -> bool:
        """Wait until a picture satisfies a condition; None waits without limit.

        Return False on a time-out.
        """
        with self._changed:
            return self._changed.wait_for(lambda: holds(self.picture), timeout_s)

    def is_served(self) -> bool:
        """Return whether the robot reports to this site and answers it; from any thread."""
        picture, why = self.picture, self.picture.why_not_in_control
        return picture.link.silent_s < _SERVED_S and (why is None or why.code != Code.NOT_ANSWERED)

    def refused(self, why: Reason) -> None:
        """Take the robot's reason for not serving this site; from any thread."""
        self.owner.put(partial(self._commanding.refused, why))

    # The owner ----------------------------------------------------------------------------------

    def _redraw(self) -> None:
        now_s = self._now_s()
        self._teaching.watch(self._commanding.in_control(self._reports.robot), now_s)
        with self._changed:
            self._drawn = self._parts.draw(now_s)
            self._changed.notify_all()

    def _tick(self) -> None:
        now_s = self._now_s()
        if (suspended_s := self._suspend.suspended_s()) > 0.0:
            self._forget_what_was_asked(f"this computer was suspended for {suspended_s:.0f} s")
        self._reports.expire_plan(now_s, self._models.confirmed_sha256(self._library.task.name))
        self._inquiries.tick(now_s)
        self._stop.tick()  # in virtual time, nobody else runs the queue
        self._commanding.tick(self._reports.robot, now_s)
        self._sending.tick(self._commanding.robot_tasks)
        self._executions.tick()
        self._camera.tick()

    # Reports of the robot -----------------------------------------------------------------------

    def _on_telemetry(self, report: Telemetry) -> None:
        if self._reports.on_telemetry(report, self._now_s()):
            self._commanding.on_report(report)
            self._catalogue.on_report(report)
            self._camera.on_report(report)
            if self._commanding.in_control(report):
                self._sending.ask_what_it_has(report.stamp.boot)

    def _on_restart(self) -> None:
        self._models.forget_confirmed()
        if self._reports.robot is not None:
            self._executions.on_restart(self._reports.robot.stamp.boot)
        self._tell("restart", "the robot was restarted: send the models again", good=False)

    def _on_model_lost(self) -> None:
        self._models.forget_confirmed()

    def _forget_what_was_asked(self, why: str) -> None:
        """Forget requests made in another situation; a stop is still resent."""
        self._teaching.roll_back(why)
        self._reports.forget_plan()
        self._commanding.pending.clear()
        self._tell("suspended", f"{why}: earlier requests are not repeated", good=False)

    def _on_event(self, event: Event) -> None:
        now_s = self._now_s()
        self._commanding.on_event(event, now_s)
        self._executions.on_event(event, now_s - self._parts.monitor.late_s(event.stamp, now_s))
        self._catalogue.on_event(event)

    def _tell(self, what: str, text: str, good: bool = True) -> None:
        self._notices.add(Notice(self._now_s(), what, text, good))
