"""What the robot itself reports, heard beside the delayed link: what a test judges it by, not the page."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from msgspec import UNSET

from farhand.common.arm.setpoint import MotionLimits
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.common.mode_table import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.messages import Telemetry
from farhand.local_site.exchange.reports import listen
from tests.browser.stack import Stack
from tests.cells import JACO

BESIDE = "--transport=tcp"
"""Option of `farhand up` with which the robot is heard beside the link: on an encrypted one that would need a certificate."""
_PATIENCE_S = 60.0
_SPEED_ROWS = 4
JUMP_M = 1e-3
_BRAKE_S, _REPORT_S = 0.1, 0.04
"""Time constant of the servo's brake, and of the robot's reports."""


@dataclass(frozen=True)
class ModeChange:
    """One change of the robot's mode.

    Args:
        before: The mode before it.
        after: The mode after it.
        speed_m_s: How fast the effector was then, at most [m/s].
        moved_m: How far it got from where it was, within the time that was asked about [m].
    """

    before: ControlMode
    after: ControlMode
    speed_m_s: float
    moved_m: float

    @property
    def allowed_m(self) -> float:
        """What a robot at rest may move, and the way that it brakes in from the speed that it had [m]."""
        v, a = self.speed_m_s, MotionLimits.of(JACO.robot).acceleration_m_s2
        return JUMP_M + v * (_BRAKE_S + _REPORT_S) + v**2 / (2.0 * a)


class RobotRecord:
    """All reports of one robot, 25 times a second, by its own clock."""

    def __init__(self) -> None:
        self._reports: list[Telemetry] = []
        self._heard = threading.Condition()

    def take(self, report: Telemetry) -> None:
        """Take a report."""
        with self._heard:
            self._reports.append(report)
            self._heard.notify_all()

    @property
    def reports(self) -> list[Telemetry]:
        """Those so far, the oldest first."""
        with self._heard:
            return list(self._reports)

    @property
    def newest(self) -> Telemetry:
        """The newest one."""
        return self._reports[-1]

    @property
    def now_s(self) -> float:
        """The robot's clock at the newest report [s]."""
        return self.newest.stamp.t_ns * 1e-9

    def shows(self, holds: Callable[[Telemetry], bool], timeout_s: float) -> bool:
        """Wait until the newest report has a property. False when it had not in time."""
        with self._heard:
            return self._heard.wait_for(lambda: bool(self._reports) and holds(self._reports[-1]), timeout_s)

    def until(self, holds: Callable[[Telemetry], bool]) -> None:
        """Wait until the newest report has a property."""
        assert self.shows(holds, _PATIENCE_S), f"waited for it in vain: {self._reports[-1:]}"

    def let_pass(self, duration_s: float) -> None:
        """Wait until so much of the robot's time has passed."""
        end_s = self.now_s + duration_s
        self.until(lambda report: report.stamp.t_ns * 1e-9 >= end_s)

    def mode_changes(self, within_s: float) -> list[ModeChange]:
        """Every change of the mode, and how far the effector got in so much time after it, or until the next."""
        reports = self.reports
        times_s = np.array([report.stamp.t_ns for report in reports]) * 1e-9
        positions_m = np.array([report.position_m for report in reports])
        speeds = np.linalg.norm(np.diff(positions_m, axis=0), axis=1) / np.diff(times_s)
        changed = [k for k in range(1, len(reports)) if reports[k].mode is not reports[k - 1].mode]
        changes = []
        for k, following in zip(changed, [*changed[1:], len(reports)], strict=True):
            end = min(following, int(np.searchsorted(times_s, times_s[k] + within_s)))
            moved_m = np.linalg.norm(positions_m[k:end] - positions_m[k - 1], axis=1).max()
            speed = speeds[max(0, k - _SPEED_ROWS) : k + 1].max()
            changes.append(ModeChange(reports[k - 1].mode, reports[k].mode, float(speed), float(moved_m)))
        return changes

    def forces_n(self, mode: ControlMode) -> np.ndarray:
        """On the tool, in each report of the newest stretch in a mode [N]."""
        forces: list[float] = []
        for report in reversed(self.reports):
            if report.mode is not mode:
                break
            forces.append(report.arm.force_n if report.arm is not UNSET else 0.0)
        return np.array(forces[::-1])


def went_m(before_m: tuple[float, ...], report: Telemetry) -> float:
    """How far the effector is from where it was [m]."""
    return float(np.linalg.norm(np.subtract(report.position_m, before_m)))


@contextmanager
def recorded(stack: Stack) -> Iterator[RobotRecord]:
    """Listen to the robot of a stack, at its own door."""
    door = re.search(r"the robot is ready: (\S+)", stack.process.words)
    assert door is not None, stack.process.words
    link = ZenohLink(EndpointSettings(connect=door[1]))
    record = RobotRecord()
    listen(link, lambda job: job(), lambda _error: None, keys.TELEMETRY, Telemetry, record.take)
    try:
        record.until(lambda _report: True)
        yield record
    finally:
        link.close()
