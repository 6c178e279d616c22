"""Texts of the page that differ between a board and an arm."""

from __future__ import annotations

from dataclasses import dataclass, replace

from farhand.common.task import AnyTask, ArmTask


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
    teach="Draw with the mouse on the LOCAL board, into the U",
    drive="Drag on the LOCAL board",
    target="the U",
    arrived="Drag the robot's U, press Execute again, or Clutch to end.",
)
_INSERT = Words(
    own="your arm",
    recording="drag the arrows, into the receptacle",
    driving="your hand drives the robot: drag the arrows",
    teach="Align turns the LOCAL plug along the bore: drag its arrows until it is in the receptacle",
    drive="Drag the arrows at the LOCAL plug",
    target="the receptacle",
    arrived="Press Retract to pull the plug out, or Clutch to end.",
)
_EXTRACT = replace(
    _INSERT,
    recording="drag the arrows, out of the receptacle",
    teach="Drag the arrows at the LOCAL plug until it is out of the receptacle",
    arrived="Press Clutch to end.",
)


def words_of(task: AnyTask) -> Words:
    """Return the texts for a task."""
    if not isinstance(task, ArmTask):
        return _BOARD
    return _INSERT if task.skill == "insert" else _EXTRACT
