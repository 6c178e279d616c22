"""Permission of commands: one rule for the page's buttons, the console and the robot.

Each side fills in the situation as far as it knows it, and adds rules of its own: the console for a pending
command or an outdated page; the robot for the age of a command, the sight of its target, and the validity of a
preview.
"""

from __future__ import annotations

from dataclasses import dataclass

from farhand.common.mode_table import Action, ControlMode, Phase, mode_after
from farhand.common.wire.reasons import Code, Reason, because


@dataclass(frozen=True)
class Situation:
    """State on which the permission of a command depends.

    Args:
        mode: Mode of the robot.
        phase: Phase of the robot.
        why_not_in_control: Reason why the asking site may not command the robot; None if it may.
        why_no_model: Reason why the robot has no model to preview or to execute; None if it has one.
        is_previewed: True if a preview is known that Execute can name.
        needs_preview: True if the task executes only after a preview.
        can_retract: True if the task defines a retreat.
    """

    mode: ControlMode
    phase: Phase
    why_not_in_control: Reason | None
    why_no_model: Reason | None
    is_previewed: bool
    needs_preview: bool
    can_retract: bool


def refusal(action: Action, situation: Situation) -> Reason | None:
    """Return the reason why an action may not be asked of the robot now; None if it may.

    Args:
        action: The action; Stop is always allowed.
        situation: State of the robot, as far as the caller knows it.
    """
    mode = situation.mode
    if action is Action.STOP:
        return None
    if situation.why_not_in_control is not None:
        return situation.why_not_in_control
    if mode_after(mode, situation.phase, action) is None:
        return because(Code.WRONG_MODE, action=action, mode=mode)
    if action is Action.RETRACT and not situation.can_retract:
        return because(Code.NO_RETRACT)
    if action not in (Action.PREVIEW, Action.EXECUTE):
        return None
    if situation.why_no_model is not None:
        return situation.why_no_model
    if action is Action.EXECUTE and situation.needs_preview:
        if mode is ControlMode.DIRECT:
            return because(Code.CLUTCH_FIRST)
        if not situation.is_previewed:
            return because(Code.NOT_PREVIEWED)
    return None
