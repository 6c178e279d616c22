"""What the robot has reported: the newest state, the newest path, every event once."""

from __future__ import annotations

from collections.abc import Callable

from farhand.common.control_mode import ControlMode
from farhand.common.errors import InvalidMessage
from farhand.common.link.link_monitor import LinkHealth, LinkMonitor
from farhand.common.wire.messages import PlannedPath, Telemetry
from farhand.local_site.exchange.event_follower import EventFollower


class Reports:
    """The robot as it was last seen. Used by the console's thread alone.

    Args:
        monitor: Learns from the reports how the link is doing.
        events: Is told to ask for what was missed.
        restarted: Called when the robot was started again: whatever was known of it counts no more.
    """

    def __init__(self, monitor: LinkMonitor, events: EventFollower, restarted: Callable[[], None]):
        self._monitor, self._events, self._restarted = monitor, events, restarted
        self.robot: Telemetry | None = None
        self.path: PlannedPath | None = None
        self.path_received_s = 0.0
        self.plan_id = 0
        """The newest preview, 0 without one that still counts."""
        self.plan_received_s = 0.0
        self._plan_stamp_ns = 0
        self.other_schema = ""
        """Why the newest message was not understood, when the robot speaks another version."""

    def on_telemetry(self, report: Telemetry, now_s: float) -> bool:
        """Take a report. False for one that is older than what is known."""
        self.other_schema = ""
        was_lost = self._monitor.view(now_s).health in (LinkHealth.NEVER, LinkHealth.LOST)
        if not self._monitor.received(report, now_s):
            return False
        before, self.robot = self.robot, report
        if before is not None and report.stamp.boot != before.stamp.boot:
            self.forget_plan()
            self._restarted()
        elif _moves(report) and report.stamp.t_ns > self._plan_stamp_ns:
            self.plan_id = 0  # it began where the robot is no more: it would be refused
        if was_lost or before is None or report.stamp.boot != before.stamp.boot:
            self._events.catch_up(report.stamp.boot)
        return True

    def on_dropped(self, error: InvalidMessage) -> None:
        """A message was not understood."""
        if error.field == "schema":
            self.other_schema = str(error)

    def forget_plan(self) -> None:
        """Whatever was previewed counts no more."""
        self.path, self.plan_id = None, 0

    def on_path(self, path: PlannedPath, now_s: float) -> None:
        """Take a path: what the robot is about to do, or the preview that was asked for."""
        self.path, self.path_received_s = path, now_s
        if path.plan_id:
            self.plan_id, self.plan_received_s = path.plan_id, now_s
            self._plan_stamp_ns = path.stamp.t_ns


def _moves(robot: Telemetry) -> bool:
    """Whether it is driven, or goes by itself to where it was not."""
    return robot.mode is ControlMode.DIRECT or (
        robot.mode is ControlMode.AUTONOMOUS and not robot.phase.at_end
    )
