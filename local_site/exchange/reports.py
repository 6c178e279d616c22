"""Newest reports of the robot: its state, its path, every event once."""

from __future__ import annotations

from collections.abc import Callable

from farhand.common.control_mode import ControlMode
from farhand.common.errors import InvalidMessage
from farhand.common.link.link_monitor import LinkMonitor
from farhand.common.wire.messages import PlannedPath, Telemetry
from farhand.local_site.exchange.event_follower import EventFollower

PLAN_GOOD_S = 60.0
"""The robot executes a preview for so long after it was made [s]."""


class Reports:
    """Robot as last reported. Used by the console's thread alone.

    Args:
        monitor: Learns the state of the link from the reports.
        events: Requests missed events.
        restarted: Called when the robot was restarted, which invalidates whatever was known of it.
    """

    def __init__(self, monitor: LinkMonitor, events: EventFollower, restarted: Callable[[], None]):
        self._monitor, self._events, self._restarted = monitor, events, restarted
        self.robot: Telemetry | None = None
        self.path: PlannedPath | None = None
        self.path_received_s = 0.0
        self.plan_id = 0
        """The newest preview, 0 without one that still counts."""
        self.plan_received_s = 0.0
        self._plan_stamp_ns, self._plan_sha256 = 0, ""
        self.other_schema = ""
        """Why the newest message was not understood, when the robot speaks another version."""

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
            self.plan_id = 0  # the robot has moved away from where the plan began: the robot would refuse it
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
            now_s: Now [s].
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
