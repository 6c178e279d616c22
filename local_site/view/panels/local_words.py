"""Text above the operator's own arm: while it is led, the place of its plug."""

from __future__ import annotations

import math

from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.words import Words
from farhand.local_site.workcell.arm_view import ArmView

_IN_M, _BESIDE_M = 0.005, 0.020
"""From this depth on, and at most so far beside the axis, the plug counts as in the receptacle [m]."""


def local_words(picture: ConsoleState, words: Words) -> str:
    """Return a short text on the workcell, as HTML."""
    arm = picture.own_arm
    if arm is not None and (arm.held or picture.recording or _is_in(arm)):
        return _where(arm)
    if picture.recording:
        return words.recording
    return words.driving if picture.coupled else words.own


def _where(arm: ArmView) -> str:
    """Return where the plug is, in the receptacle or in front of it."""
    askew = f"{math.degrees(arm.tilt_rad):.0f}° askew"
    if _is_in(arm):
        return f"{1e3 * arm.depth_m:.0f} mm deep, {'jammed: ' if arm.saturated else ''}{askew}"
    if arm.saturated:
        return "the arm cannot follow there"
    side = "away" if arm.depth_m <= 0.0 else "past"
    red_m, green_m = TaskFrame.at(arm.tip).to_local(arm.receptacle)[:2]
    red, green = _along("red", red_m), _along("green", green_m)
    return f'<span class="fh-way">{1e3 * abs(arm.depth_m):.0f} mm {side}, {red}, {green}, {askew}</span>'


def _along(arrow: str, way_m: float) -> str:
    """Return the distance to the bore along an arrow at the plug, negative against the arrow."""
    return f'<span class="fh-{arrow}-arrow">{arrow} {round(1e3 * way_m):+d}</span>'


def _is_in(arm: ArmView) -> bool:
    return arm.depth_m > _IN_M and arm.lateral_m < _BESIDE_M
