"""Permission of commands at the console: the common rule, and rules of this site.

The page's buttons and the console use the same function, so that no button offers a command that the console refuses.
"""

from __future__ import annotations

from farhand.common.control_mode import Action, ControlMode
from farhand.common.errors import FarhandError
from farhand.common.permission import Situation, refusal
from farhand.common.wire.messages import Telemetry
from farhand.common.wire.reasons import Code, Reason, because
from farhand.common.wire.words import sentence
from farhand.local_site.console.console_state import ConsoleState


class CommandRefused(FarhandError):
    """Refusal of a command by the console.

    Args:
        reason: Reason of the refusal.
    """

    def __init__(self, reason: Reason):
        self.reason = reason
        super().__init__(sentence(reason))


def command_refusal(action: Action, picture: ConsoleState, shown: ControlMode | None = None) -> Reason | None:
    """Return the reason why a command may not be sent now; None if it may. The robot checks it again.

    Args:
        action: Action of the command; Stop is always allowed.
        picture: State of the console.
        shown: Mode that the page showed to the operator; None to skip this check.
    """
    robot = picture.robot
    if action is Action.STOP:
        return None
    if picture.other_schema:
        return because(Code.OTHER_VERSION)
    if robot is None:
        return because(Code.NOT_REPORTED)
    if shown is not None and shown is not robot.mode:
        return because(Code.PAGE_BEHIND, shown=shown, mode=robot.mode)
    if action in picture.pending:
        return because(Code.UNDER_WAY, action=action)
    if action is Action.RESET and picture.stop is not None and not picture.stop.settled:
        return because(Code.OWN_STOP)
    if (reason := refusal(action, _situation(picture, robot))) is not None:
        return reason
    if action is Action.COUPLE and picture.recording:
        return because(Code.RECORDING_HERE)
    if action is Action.RECORD and picture.robot_records:
        return because(Code.RECORDING_ALREADY)
    return None


def _situation(picture: ConsoleState, robot: Telemetry) -> Situation:
    return Situation(
        mode=robot.mode,
        phase=robot.phase,
        why_not_in_control=None if picture.in_control else _why_not_in_control(picture, robot),
        why_no_model=_why_no_model(picture),
        is_previewed=bool(picture.plan_id),
        needs_preview=picture.task.require_preview,
        can_retract=picture.task.retract_m is not None,
    )


def _why_not_in_control(picture: ConsoleState, robot: Telemetry) -> Reason:
    why = picture.why_not_in_control
    if robot.holder and (why is None or why.code == Code.HELD):
        return because(Code.OTHER_IN_CONTROL, site=robot.holder)
    return why or because(Code.LEASE_ENDED)


def _why_no_model(picture: ConsoleState) -> Reason | None:
    if not picture.confirmed_sha256:
        return because(Code.NO_MODEL)
    return because(Code.MODEL_DIFFERS) if picture.standing.differs else None
