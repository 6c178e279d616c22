"""The one rule for what the operator may ask now: of the robot, of this site, and about the control.

The page's buttons, the console and the script ask the same function, so that a button never offers what the
console would refuse. What the robot allows is `farhand.common.command_refusal`, what a task's demonstrations allow is
`farhand.local_site.teaching.teaching_permission`; this file adds what the console alone knows.
"""

from __future__ import annotations

from farhand.common.command_refusal import Situation, refusal
from farhand.common.mode_table import Action, ControlMode
from farhand.common.task import ArmTask
from farhand.common.wire.messages import Telemetry, Wish
from farhand.common.wire.reasons import Code, Reason, because
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.teaching.teaching_permission import Act, teaching_refusal
from farhand.local_site.workcell.hand_motion import can_centre

_ACTS: dict[type[intents.Intent], Act] = {
    intents.RecordDemonstration: Act.RECORD,
    intents.EndDemonstration: Act.END,
    intents.Undo: Act.UNDO,
    intents.LoadSamples: Act.LEARN,
    intents.LearnFile: Act.LEARN,
    intents.Recover: Act.RECOVER,
    intents.SelectRevision: Act.GO_TO,
    intents.StartAnew: Act.START_ANEW,
    intents.Delete: Act.DELETE,
    intents.RemoveDemonstration: Act.REMOVE,
}


def refusal_of(intent: intents.Intent, state: ConsoleState) -> Reason | None:
    """Return why an intent is not done now; None when it may be.

    Args:
        intent: Intent of the operator.
        state: State of the console.
    """
    match intent:
        case intents.CommandRobot(action, shown):
            return command_refusal(action, state, shown)
        case intents.WishControl(wish):
            return _wish_refusal(wish, state)
        case intents.SendModel() | intents.SendLibrary():
            return _sending_refusal(intent, state)
        case intents.Choose(task):
            return _choice_refusal(task, state)
        case intents.Align() | intents.Centre() | intents.StepArm() | intents.ResetArm():
            return _arm_refusal(intent, state)
        case intents.Hand() | intents.DragTarget() | intents.AutoSend() | intents.WatchCamera():
            return None
    return _teaching_refusal(intent, state)


def command_refusal(action: Action, state: ConsoleState, shown: ControlMode | None = None) -> Reason | None:
    """Return the reason why a command may not be sent now; None if it may. The robot checks it again.

    Args:
        action: Action of the command; Stop is always allowed.
        state: State of the console.
        shown: Mode that the page showed to the operator; None to skip this check.
    """
    robot = state.robot
    if action is Action.STOP:
        return None
    if state.other_schema:
        return because(Code.OTHER_VERSION)
    if robot is None:
        return because(Code.NOT_REPORTED)
    if shown is not None and shown is not robot.mode:
        return because(Code.PAGE_BEHIND, shown=shown, mode=robot.mode)
    if action in state.pending:
        return because(Code.UNDER_WAY, action=action)
    if action is Action.RESET and state.stop is not None and not state.stop.settled:
        return because(Code.OWN_STOP)
    if (reason := refusal(action, _situation(state, robot))) is not None:
        return reason
    if action is Action.COUPLE and state.recording:
        return because(Code.RECORDING_HERE)
    if action is Action.RECORD and state.robot_records:
        return because(Code.RECORDING_ALREADY)
    return None


def _situation(state: ConsoleState, robot: Telemetry) -> Situation:
    return Situation(
        mode=robot.mode,
        phase=robot.phase,
        why_not_in_control=None if state.in_control else _why_not_in_control(state, robot),
        why_no_model=_why_no_model(state),
        is_previewed=bool(state.plan_id),
        needs_preview=state.task.require_preview,
        can_retract=state.task.retract_m is not None,
    )


def _why_not_in_control(state: ConsoleState, robot: Telemetry) -> Reason:
    why = state.why_not_in_control
    if robot.holder and (why is None or why.code == Code.HELD):
        return because(Code.OTHER_IN_CONTROL, site=robot.holder)
    return why or because(Code.LEASE_ENDED)


def _why_no_model(state: ConsoleState) -> Reason | None:
    if not state.confirmed_sha256:
        return because(Code.NO_MODEL)
    return because(Code.MODEL_DIFFERS) if state.standing.differs else None


def _teaching_refusal(intent: intents.Intent, state: ConsoleState) -> Reason | None:
    """Judge an intent about demonstrations; while coupled, the robot records instead of this site."""
    match intent:
        case intents.RecordDemonstration() if state.coupled:
            return command_refusal(Action.RECORD, state)
        case intents.EndDemonstration() | intents.Undo() if state.robot_records:
            return command_refusal(Action.END_RECORDING, state)
        case intents.SelectRevision(number) | intents.Delete(number):
            return teaching_refusal(_ACTS[type(intent)], state, number)
        case intents.RemoveDemonstration(name):
            return teaching_refusal(Act.REMOVE, state, name=name)
    return teaching_refusal(_ACTS[type(intent)], state)


def _arm_refusal(intent: intents.MoveHand | intents.ResetArm, state: ConsoleState) -> Reason | None:
    if isinstance(intent, intents.ResetArm):
        if not state.can_move_place:
            return because(Code.NO_OTHER_PLACE)
        return because(Code.RECORDING_HERE) if state.recording else None
    if not isinstance(state.task, ArmTask) or state.own_arm is None:
        return because(Code.NO_OWN_ARM)
    if state.coupled:
        return because(Code.HAND_DRIVES)
    far = isinstance(intent, intents.Centre) and not can_centre(state.own_arm)
    return because(Code.NOT_BEFORE_MOUTH) if far else None


def _choice_refusal(name: str, state: ConsoleState) -> Reason | None:
    names = tuple(task.name for task in state.tasks)
    if name not in names:
        return because(Code.NO_SUCH_TASK, task=name, has=names)
    if state.recording or state.robot_records:
        return because(Code.RECORDING_HERE)
    if state.mode in (ControlMode.AUTONOMOUS, ControlMode.PAUSED):
        return because(Code.ROBOT_EXECUTES, task=state.task.name)
    under_way = next((each for each in (Action.PREVIEW, Action.EXECUTE) if each in state.pending), None)
    return because(Code.UNDER_WAY, action=under_way) if under_way is not None else None


def _sending_refusal(intent: intents.SendModel | intents.SendLibrary, state: ConsoleState) -> Reason | None:
    whole = isinstance(intent, intents.SendLibrary)
    taught = [each for each in (state.tasks if whole else (state.standing,)) if each.learned_sha256]
    if not taught:
        return because(Code.NOTHING_TAUGHT)
    if not any(each.robot_does for each in taught):
        return because(Code.OTHER_TASK, does=state.robot_tasks, task=tuple(each.name for each in taught))
    if state.sending_library if whole else state.standing.sending_sha256 == state.standing.learned_sha256:
        return because(Code.UNDER_WAY, action=intent.label)
    return None if any(each.differs for each in taught) else because(Code.HAS_IT)


def _wish_refusal(wish: Wish, state: ConsoleState) -> Reason | None:
    if wish in (Wish.CONTROL, Wish.WATCH):
        return because(Code.WATCHING) if wish is state.wish is Wish.WATCH else None
    if state.robot is None:
        return because(Code.NOT_REPORTED)
    if wish is Wish.GIVE:
        if not state.in_control:
            return because(Code.LEASE_ENDED)
        return None if state.asked_by else because(Code.NOBODY_ASKS)
    if state.in_control:
        return because(Code.IN_CONTROL)
    return because(Code.UNDER_WAY, action="ask for control") if state.wish is Wish.ASK else None
