"""Words that differ between a board and an arm, and those above the operator's own arm: the place of its plug."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace

from msgspec import structs

from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import AnyTask, ArmTask
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.workcell.arm_view import ArmView


@dataclass(frozen=True)
class TaskWords:
    """Parts of sentences.

    Args:
        own: Name of the operator's board or arm.
        recording: Action while a demonstration is recorded.
        driving: Action while the hand drives the robot.
        teach: Instruction for a demonstration.
        drive: Instruction for driving the robot.
        target: Name of the robot's target.
        arrived: What can be done after the arrival.
    """

    own: str
    recording: str
    driving: str
    teach: str
    drive: str
    target: str
    arrived: str


_BOARD = TaskWords(
    own="your board",
    recording="draw to {target}",
    driving="your hand drives the robot: drag here",
    teach="Draw with the mouse on your own board, to {target}",
    drive="Drag on your own board, or hold a key down (J L U O)",
    target="the {frame}",
    arrived="Press Execute again, or Clutch to end.",
)
_INSERT = TaskWords(
    own="your arm",
    recording="drag the arrows, into {target}",
    driving="your hand drives the robot: drag the arrows",
    teach="Drag the arrows at your own plug to the front of {target}",
    drive="Drag the arrows at your own plug, or hold a key down (J L U O I K)",
    target="the {frame}",
    arrived="Press Retract to pull the plug out, or Clutch to end.",
)
_EXTRACT = replace(
    _INSERT,
    recording="drag the arrows, out of {target}",
    teach="Drag the arrows at your own plug until it is out of {target}",
    arrived="Press Clutch to end.",
)
_ARM = {"insert": _INSERT, "extract": _EXTRACT}


def words_of(task: AnyTask) -> TaskWords:
    """Return the texts for a task: its own words, else the usual ones of its kind."""
    usual = _ARM[task.skill] if isinstance(task, ArmTask) else _BOARD
    own = {name: text for name, text in structs.asdict(task.words).items() if text is not None}
    target = own.pop("target", usual.target.format(frame=task.frame_names[-1]))
    said = {name: text.format(target=target) for name, text in asdict(replace(usual, target=target)).items()}
    return TaskWords(**said | own)


_IN_M, _BESIDE_M = 0.005, 0.020
"""From this depth on, and at most so far beside the axis, the plug counts as in the receptacle [m]."""


def local_words(state: ConsoleState, words: TaskWords) -> str:
    """Return a short text on the workcell, as HTML."""
    arm = state.own_arm
    if arm is not None and (arm.held or state.recording or _is_in(arm)):
        return _where(arm)
    if state.recording:
        return words.recording
    return words.driving if state.coupled else words.own


def _where(arm: ArmView) -> str:
    """Return where the plug is, in the receptacle or in front of it."""
    askew = askew_words(arm.tilt_rad)
    if _is_in(arm):
        return f"{1e3 * arm.depth_m:.0f} mm deep, {'jammed: ' if arm.saturated else ''}{askew}"
    if arm.saturated:
        return "the arm cannot follow there"
    side = "away" if arm.depth_m <= 0.0 else "past"
    red_m, green_m = TaskFrame.at(arm.tip).to_local(arm.receptacle)[:2]
    red, green = _along("red", red_m), _along("green", green_m)
    return f'<span class="fh-way">{1e3 * abs(arm.depth_m):.0f} mm {side}, {red}, {green}, {askew}</span>'


def askew_words(tilt_rad: float) -> str:
    """Return the angle between the plug and the bore."""
    return f"{math.degrees(tilt_rad):.0f}° askew"


def beside_words(beside_m: float) -> str:
    """Return the distance of the plug from the bore's axis."""
    return f"{1e3 * beside_m:.0f} mm beside"


def to_go_words(arm: ArmView) -> str:
    """Return the way of the plug to the mouth, or its depth in the bore."""
    depth_mm = 1e3 * arm.depth_m
    if depth_mm <= 0.0:
        return f"{-depth_mm:.0f} mm to go to the mouth"
    return f"{depth_mm:.0f} of {1e3 * arm.bore_m:.0f} mm deep"


def keys_words(turns: bool) -> str:
    """Return what the keys do to the plug.

    Args:
        turns: True if they turn it, and do not move it.
    """
    does, size = ("Turn", "1°, with Shift 0.2°") if turns else ("Move", "5 mm, with Shift 1 mm")
    return f"{does} by keys: {size}. Held down: on until released."


def _along(arrow: str, way_m: float) -> str:
    """Return the distance to the bore along an arrow at the plug, negative against the arrow."""
    return f'<span class="fh-{arrow}-arrow">{arrow} {round(1e3 * way_m):+d}</span>'


def _is_in(arm: ArmView) -> bool:
    return arm.depth_m > _IN_M and arm.lateral_m < _BESIDE_M
