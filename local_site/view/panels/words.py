"""Texts of the page: those that differ between a board and an arm, and those that name a reason or an outcome.

Text above the operator's own arm: while it is led, the place of its plug.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import AnyTask, ArmTask
from farhand.common.wire.messages import ExecutionReport
from farhand.common.wire.words import sentence
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.console.executions import Executions, ReportedExecution
from farhand.local_site.workcell.arm_view import ArmView


@dataclass(frozen=True)
class Words:
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


_BOARD = Words(
    own="your board",
    recording="draw into the U",
    driving="your hand drives the robot: drag here",
    teach="Draw with the mouse on your own board, into the U",
    drive="Drag on your own board",
    target="the U",
    arrived="Drag the robot's U, press Execute again, or Clutch to end.",
)
_INSERT = Words(
    own="your arm",
    recording="drag the arrows, into the receptacle",
    driving="your hand drives the robot: drag the arrows",
    teach="Drag the arrows at your own plug to the front of the receptacle",
    drive="Drag the arrows at your own plug",
    target="the receptacle",
    arrived="Press Retract to pull the plug out, or Clutch to end.",
)
_EXTRACT = replace(
    _INSERT,
    recording="drag the arrows, out of the receptacle",
    teach="Drag the arrows at your own plug until it is out of the receptacle",
    arrived="Press Clutch to end.",
)


def words_of(task: AnyTask) -> Words:
    """Return the texts for a task."""
    if not isinstance(task, ArmTask):
        return _BOARD
    return _INSERT if task.skill == "insert" else _EXTRACT


_IN_M, _BESIDE_M = 0.005, 0.020
"""From this depth on, and at most so far beside the axis, the plug counts as in the receptacle [m]."""


def local_words(state: ConsoleState, words: Words) -> str:
    """Return a short text on the workcell, as HTML."""
    arm = state.own_arm
    if arm is not None and (arm.held or state.recording or _is_in(arm)):
        return _where(arm)
    if state.recording:
        return words.recording
    return words.driving if state.coupled else words.own


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


def loss_words(transport: str, in_bursts: bool) -> str:
    """Return what to know about the simulated link's loss; empty where its slider tells all.

    Args:
        transport: Transport of the present connections, "tcp" or "udp"; empty without any.
        in_bursts: True if datagrams are lost in bursts, which the slider does not show.
    """
    if transport == "tcp":
        return "A TCP connection loses no packets: loss and a change of ports need --transport quic."
    if transport == "udp" and in_bursts:
        return "Loss comes in bursts, as set at the link's control socket; the slider replaces them."
    return ""


def count_words(executions: Executions) -> str:
    """Return the share of the executions that reached the end of their motion, in words."""
    n = executions.n_ended
    return f"{executions.n_reached_end} of {n} ended as they should" if n else "none has ended yet"


def outcome_words(execution: ReportedExecution, newest: bool) -> str:
    """Return how an execution ended, or that it has not.

    Args:
        execution: Execution.
        newest: True if it is the newest: another one without an end is over, though nobody told why.
    """
    if execution.ended is None:
        return "under way" if newest else "its end was not told"
    if execution.reached_end:
        phase = (each.value for each in execution.ended.values if each.name == "phase")
        return str(next(phase, "at its end"))
    return sentence(execution.ended)


def at_the_end(report: ExecutionReport) -> str:
    """Return the place at which an execution ended as the robot measured it; empty where it cannot know."""
    parts = []
    if report.depth_m is not None:
        side = "deep" if report.depth_m >= 0.0 else "before the mouth"
        parts.append(f"{1e3 * abs(report.depth_m):.0f} mm {side}")
    if report.lateral_m is not None:
        parts.append(f"{1e3 * report.lateral_m:.1f} mm beside")
    if report.end_error_m is not None:
        parts.append(f"{1e3 * report.end_error_m:.0f} mm off")
    return ", ".join(parts)


def upload_words(most_bytes: int) -> str:
    """Return what can be uploaded.

    Args:
        most_bytes: Largest size of a file [B].
    """
    return (
        f"Upload: a .npz as downloaded here, or made by farhand import, of at most {1e-6 * most_bytes:g} MB."
    )
