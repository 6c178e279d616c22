"""What the robot has reported: the newest state, the newest path, every event once."""

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
        self._plan_stamp_ns, self._plan_sha256 = 0, ""
        self.other_schema = ""
        """Why the newest message was not understood, when the robot speaks another version."""

    def on_telemetry(self, report: Telemetry, now_s: float) -> bool:
        """Take a report. False for one that is older than what is known."""
        self.other_schema = ""
        was_lost = self._monitor.is_silent(now_s)
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

    def expire_plan(self, now_s: float, sha256: str) -> None:
        """Forget a preview that the robot would refuse: too old, or of another model than it has.

        Args:
            now_s: Now [s].
            sha256: Of the model that the robot has confirmed; empty when that is not known.
        """
        too_old = now_s - self.plan_received_s > PLAN_GOOD_S
        if self.plan_id and (too_old or sha256 not in ("", self._plan_sha256)):
            self.forget_plan()

    def on_path(self, path: PlannedPath, now_s: float) -> None:
        """Take a path: what the robot is about to do, or the preview that was asked for."""
        self.path, self.path_received_s = path, now_s
        if path.plan_id:
            self.plan_id, self.plan_received_s = path.plan_id, now_s
            self._plan_stamp_ns, self._plan_sha256 = path.stamp.t_ns, path.model_sha256


def _moves(robot: Telemetry) -> bool:
    """Whether it is driven, or goes by itself to where it was not."""
    return robot.mode is ControlMode.DIRECT or (
        robot.mode is ControlMode.AUTONOMOUS and not robot.phase.at_end
    )
