"""Timing of the page's redraws: at once after a change, otherwise slowly for running clocks.

While the robot or the hand moves, only the picture follows at once: nobody reads numbers thirty times a second.
"""

from __future__ import annotations

import operator
from enum import IntEnum

from msgspec import UNSET

from farhand.common.mode_table import ControlMode
from farhand.common.wire.messages import Telemetry
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene.nodes import SEEN_UNCHANGED, UNCHANGED

AT_REST_S = 0.5
"""Time between two redraws while only ages change [s]."""
WORDS_S = 0.1
"""Time between two redraws of the words while only poses change [s]."""
_equal = operator.attrgetter(
    "mode", "phase", "link.health", "in_control", "why_not_in_control", "wish", "asked_by", "pending", "notices",
    "task", "tasks", "sending_library", "recording", "demonstration_names", "can_recover", "auto_send", "revisions",
    "revision", "plan_id", "stop", "robot_records", "fetching", "scene_fetching", "miss",
)  # fmt: skip
_identical = operator.attrgetter(
    "learned", "robot_model", "forming", "path", "robot_scene", "executions", "camera"
)
_executed = operator.attrgetter("component", "waiting", "pace")


class Extent(IntEnum):
    """Part of the page to draw."""

    NOTHING = 0
    PICTURE = 1
    """Arms, points and the gauge at the hand."""
    ALL = 2


class Redraw:
    """Timer of the redraws. Used by the page's thread."""

    def __init__(self) -> None:
        self._words: ConsoleState | None = None
        self._picture: ConsoleState | None = None
        """States of which the words and the picture were drawn."""
        self._words_s = float("-inf")

    def due(self, state: ConsoleState, now_s: float, plays: bool = False) -> Extent:
        """Decide how much of a state to draw now; that is noted as drawn.

        Args:
            state: Present state of the console.
            now_s: Now [s].
            plays: True while the picture moves without the robot, as that of a played preview does.
        """
        words, moves = self._words, plays or self._picture is None or moves_on(self._picture, state)
        waited_s = now_s - self._words_s
        if words is None or facts_differ(words, state) or waited_s >= (WORDS_S if moves else AT_REST_S):
            self._words, self._words_s, self._picture = state, now_s, state
            return Extent.ALL
        if not moves:
            return Extent.NOTHING
        self._picture = state
        return Extent.PICTURE

    def soon(self) -> None:
        """Draw all of the next state in any case, because the page itself has changed."""
        self._words = None


def facts_differ(before: ConsoleState, after: ConsoleState) -> bool:
    """Decide whether anything has changed that is more than a pose or an age."""
    if _equal(before) != _equal(after):
        return True
    if any(a is not b for a, b in zip(_identical(before), _identical(after), strict=True)):
        return True
    if before.robot is None or after.robot is None:
        return before.robot is not after.robot
    return _executed(before.robot) != _executed(after.robot)


def moves_on(before: ConsoleState, after: ConsoleState) -> bool:
    """Decide whether a pose has changed visibly, or the ghost moves."""
    if after.mode is ControlMode.AUTONOMOUS and not after.phase.at_end:
        return True
    return before.own_arm is not after.own_arm or moved(before.robot, after.robot)


def moved(before: Telemetry | None, after: Telemetry | None) -> bool:
    """Decide whether a later report differs visibly in pose or in the execution's state."""
    if before is None or after is None:
        return before is not after
    if _executed(before) != _executed(after):
        return True
    return (
        _apart(_own(before), _own(after), min(UNCHANGED))
        or _apart(before.frame_origin_m, after.frame_origin_m, SEEN_UNCHANGED[0])
        or _apart(before.frame_rotation_rad, after.frame_rotation_rad, SEEN_UNCHANGED[1])
        or _apart(before.other_frames or (), after.other_frames or (), SEEN_UNCHANGED[0])
    )


def _own(robot: Telemetry) -> tuple[float, ...]:
    return robot.position_m if robot.arm is UNSET else (*robot.position_m, *robot.arm.joints_rad)


def _apart(before: tuple[float, ...], after: tuple[float, ...], limit: float) -> bool:
    return any(abs(a - b) > limit for a, b in zip(before, after, strict=False))
