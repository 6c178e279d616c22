"""History of this session: the robot's reports as they came, so that the page can show the robot as it was then."""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray

from farhand.common.mode_table import ControlMode, Phase
from farhand.common.wire.messages import PlannedPath, Telemetry
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.report_age import LinkHealth
from farhand.local_site.teaching.lesson import LearnedModel
from farhand.local_site.view.redraw import moved
from farhand.local_site.view.scene.ghost import tip_in_frame

Array = NDArray[np.float64]

MOVING_S, AT_REST_S = 0.2, 1.0
"""Time between two moments while the robot moves, and at rest [s]."""
MOST_MOMENTS = 6000
"""Largest number of kept moments; beyond it the older half is thinned, so that a session of any length is kept whole."""
_EXECUTES = (ControlMode.AUTONOMOUS, ControlMode.PAUSED)
_ON_ITS_WAY_BACK = (Phase.RETRACTING, Phase.GOING_TO_READY)


@dataclass(frozen=True, eq=False)
class Moment:
    """State of the robot as it was known at one moment.

    Args:
        time_s: Time on the console's clock [s].
        robot: Newest report; None before the first one.
        age_s: Age of the report [s]; None while unknown.
        heard: False during an outage: what was known of the robot was old.
        tip: Tip of the tool, or the point, in the task frame. Shape (D,) [m]; None without a report.
        path: Newest path.
        model: Model that the robot had; None without one.
    """

    time_s: float
    robot: Telemetry | None = None
    age_s: float | None = None
    heard: bool = True
    tip: Array | None = None
    path: PlannedPath | None = None
    model: LearnedModel | None = None

    @property
    def mode(self) -> str:
        """Name of the mode with its phase; empty before the first report."""
        return f"{self.robot.mode.name} {self.robot.phase}".strip() if self.robot is not None else ""

    @property
    def component(self) -> int:
        """Component in execution; -1 for none."""
        return self.robot.component if self.robot is not None else -1

    @property
    def force_n(self) -> float | None:
        """Force on the tool [N]; None without an arm."""
        return None if self.robot is None or self.robot.arm is UNSET else self.robot.arm.force_n

    @property
    def depth_mm(self) -> float | None:
        """Depth of the tool in the receptacle [mm]; None without an arm."""
        return None if self.force_n is None or self.tip is None else 1e3 * float(self.tip[2])

    @property
    def executes(self) -> bool:
        """True while a learned motion is executed, or paused."""
        robot = self.robot
        return robot is not None and robot.mode in _EXECUTES and robot.phase not in _ON_ITS_WAY_BACK


def moment(state: ConsoleState, now_s: float) -> Moment:
    """Return what is kept of a state."""
    robot, age_s = state.robot, state.link.age_s
    return Moment(
        time_s=now_s,
        robot=robot,
        age_s=age_s + now_s - state.now_s if age_s is not None and math.isfinite(age_s) else None,
        heard=robot is None or state.link.health is LinkHealth.OK,
        tip=tip_in_frame(robot) if robot is not None else None,
        path=state.path,
        model=state.robot_model,
    )


def as_it_was(state: ConsoleState, then: Moment) -> ConsoleState:
    """Return a state whose robot is that of an earlier moment, and old; all of the operator's own is of now."""
    link = replace(state.link, health=LinkHealth.LOST)
    return replace(state, robot=then.robot, path=then.path, plan_id=0, robot_model=then.model, link=link)


class History:
    """Moments of this session. Used by the page's thread."""

    def __init__(self) -> None:
        self._moments: list[Moment] = []
        self._trace: tuple[Moment | None, Array | None] = (None, None)

    def note(self, state: ConsoleState, now_s: float) -> None:
        """Keep a moment, if one is due; the first report of the robot is the first."""
        if state.robot is None and not self._moments:
            return
        last = self._moments[-1] if self._moments else None
        since_s = now_s - last.time_s if last is not None else math.inf
        if since_s >= AT_REST_S or (since_s >= MOVING_S and last is not None and _differs(last, state)):
            self._moments.append(moment(state, now_s))
            if len(self._moments) > MOST_MOMENTS:
                half = len(self._moments) // 2
                self._moments[:half] = self._moments[:half:2]

    @property
    def newest(self) -> Moment | None:
        """Newest moment; None before the first."""
        return self._moments[-1] if self._moments else None

    @property
    def began_s(self) -> float:
        """Time of the first moment [s]; infinite before it."""
        return self._moments[0].time_s if self._moments else math.inf

    def at(self, time_s: float) -> Moment | None:
        """Return the last moment that is not later than a time, or else the first; None before any."""
        if not self._moments:
            return None
        return self._moments[max(self._until(time_s) - 1, 0)]

    def since(self, time_s: float) -> list[Moment]:
        """Return the moments from a time on, with the one before it, which held until then."""
        return self._moments[max(self._until(time_s) - 1, 0) :]

    def trace(self, until: Moment | None) -> Array | None:
        """Return where the tip went in the newest execution that had begun by a moment; None without one. Shape (n, D)."""
        if until is not self._trace[0]:
            self._trace = until, self._find_trace(until)
        return self._trace[1]

    def _find_trace(self, until: Moment | None) -> Array | None:
        if until is None:
            return None
        number = self._back_while(self._until(until.time_s), lambda each: not each.executes)
        began = self._back_while(number, lambda each: each.executes)
        tips = [each.tip for each in self._moments[began:number] if each.tip is not None]
        return np.array(tips) if len(tips) > 1 else None

    def _back_while(self, number: int, holds: Callable[[Moment], bool]) -> int:
        """Return how many moments are before those, up to a number, of which something holds without a break."""
        while number > 0 and holds(self._moments[number - 1]):
            number -= 1
        return number

    def _until(self, time_s: float) -> int:
        """Return the number of moments that are not later than a time."""
        return bisect.bisect_right(self._moments, time_s, key=lambda each: each.time_s)


def _differs(last: Moment, state: ConsoleState) -> bool:
    robot, heard = state.robot, state.robot is None or state.link.health is LinkHealth.OK
    if heard != last.heard or moved(last.robot, robot):
        return True
    return (
        last.robot is not None
        and robot is not None
        and (last.robot.mode, last.robot.phase) != (robot.mode, robot.phase)
    )
