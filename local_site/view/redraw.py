"""Timing of the page's redraws: at once after a change, otherwise slowly for running clocks."""

from __future__ import annotations

import operator

from msgspec import UNSET

from farhand.common.control_mode import ControlMode
from farhand.common.wire.messages import Telemetry
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene.nodes import SEEN_UNCHANGED, UNCHANGED

AT_REST_S = 0.25
"""Time between two redraws while only ages change [s]."""
_equal = operator.attrgetter(
    "mode", "phase", "link.health", "in_control", "why_not_in_control", "wish", "asked_by", "pending", "notices",
    "task", "tasks", "sending_library", "recording", "demonstration_names", "can_recover", "auto_send", "revisions",
    "revision", "plan_id", "stop", "robot_records", "fetching", "scene_fetching", "miss",
)  # fmt: skip
_identical = operator.attrgetter(
    "learned", "robot_model", "forming", "own_arm", "path", "robot_scene", "executions", "camera"
)


class Redraw:
    """Timer of the redraws. Used by the page's thread."""

    def __init__(self) -> None:
        self._drawn: ConsoleState | None = None
        self._drawn_s = float("-inf")

    def due(self, state: ConsoleState, now_s: float) -> bool:
        """Decide whether to draw a state now; if so, it is noted as drawn.

        Args:
            state: Present state of the console.
            now_s: Now [s].
        """
        rested = now_s - self._drawn_s >= AT_REST_S
        if not (rested or self._drawn is None or differs(self._drawn, state)):
            return False
        self._drawn, self._drawn_s = state, now_s
        return True

    def soon(self) -> None:
        """Draw the next state in any case, because the page itself has changed."""
        self._drawn = None


def differs(before: ConsoleState, after: ConsoleState) -> bool:
    """Decide whether anything visible has changed, or the ghost moves."""
    if after.mode is ControlMode.AUTONOMOUS and not after.phase.at_end:
        return True
    if _equal(before) != _equal(after) or moved(before.robot, after.robot):
        return True
    return any(a is not b for a, b in zip(_identical(before), _identical(after), strict=True))


def moved(before: Telemetry | None, after: Telemetry | None) -> bool:
    """Decide whether a later report differs visibly in pose or in the execution's state."""
    if before is None or after is None:
        return before is not after
    if (before.component, before.waiting, before.pace) != (after.component, after.waiting, after.pace):
        return True
    return (
        _apart(_own(before), _own(after), min(UNCHANGED))
        or _apart(before.frame_origin_m, after.frame_origin_m, SEEN_UNCHANGED[0])
        or _apart(before.frame_rotation_rad, after.frame_rotation_rad, SEEN_UNCHANGED[1])
    )


def _own(robot: Telemetry) -> tuple[float, ...]:
    return robot.position_m if robot.arm is UNSET else (*robot.position_m, *robot.arm.joints_rad)


def _apart(before: tuple[float, ...], after: tuple[float, ...], limit: float) -> bool:
    return any(abs(a - b) > limit for a, b in zip(before, after, strict=False))
