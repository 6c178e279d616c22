"""Sentences for reasons: the one place where codes on the wire become text.

The values of a code are the names in its sentence. `{x:mm}` and `{x:deg}` convert a length and an angle,
`{x:quoted}` lists names, `{x:upper}` is for modes; `{cause}` is the reason behind the reason.
"""

from __future__ import annotations

import math

from farhand.common.mode_table import Action, modes_allowing
from farhand.common.wire.reasons import N_MORE, Code, Reason

WORDS: dict[Code, str] = {
    Code.OTHER: "{text}",
    # The session
    Code.NO_ECHO: "this {what} came too late: it echoes no report of the robot",
    Code.OTHER_BOOT: "this {what} came too late: it echoes another boot of the robot",
    Code.NEVER_SENT: "this {what} came too late: it echoes a report that was never sent",
    Code.TOO_OLD: "this {what} came too late: it is {age_s:.2f} s old, at most {limit_s:.2f} s is allowed",
    Code.ANONYMOUS: "a request must name its session, and a site whose name has letters or digits",
    Code.TAKEN_OVER: "another site named {site} has taken over: this site was started again, or there is a second one of this name "
    "(--site-name tells them apart); this one only watches",
    Code.ONLY_WATCHES: "it only watches",
    Code.WATCHING: "watching",
    Code.HANDED_OVER: "handed over to {site}",
    Code.WAITING_TO_HEAR: "waiting to hear the robot",
    Code.HELD: "held by {site} for {held_s:.0f} s",
    Code.LEASE_ENDED: "you are not in control: the lease ended",
    Code.LEASE_CHANGED: "the control of the robot was lost for a moment; it is back: press again",
    Code.OTHER_IN_CONTROL: "{site} is in control",
    Code.NOTHING_IN_TIME: "none of its messages arrived in time for {lease_s:g} s",
    Code.CONTROL_TAKEN: "{site} is in control",
    Code.CONTROL_LOST: "{site} is not in control any more: {cause}",
    Code.UNLISTED: "the robot refuses this site: its list of sites does not name {site}",
    Code.REVOKED: "the robot refuses this site: {site} was revoked on {text}",
    Code.OTHER_NAME: "refused: the certificate is that of {site}, and the request calls the site {text}; start it as {site}",
    Code.OBSERVER: "{site} may only watch and stop, as the robot's list of sites says",
    Code.OTHER_ROBOT: "the list of sites lets {site} reach other robots, not {text}",
    # Commands
    Code.NOT_ANSWERED: "the robot has not answered yet",
    Code.NOT_REPORTED: "the robot has not reported yet",
    Code.OTHER_VERSION: "the robot runs another version: install the same Farhand on both sites",
    Code.PAGE_BEHIND: "page was behind: it showed {shown:upper}, the robot is in {mode:upper}",
    Code.UNDER_WAY: "{action} is under way already",
    Code.OWN_STOP: "your own stop is not acknowledged yet",
    Code.RECORDING_HERE: "a demonstration is being recorded: end or undo it first",
    Code.OWN_KEY: "a stop travels on its own key",
    Code.WRONG_MODE: "{action} is not allowed in {mode:upper}, only in {action:modes}",
    Code.NO_RETRACT: "this task defines no retreat (`retract_m`)",
    Code.OTHER_TASK: "this robot does {does:quoted}, not {task:quoted}",
    Code.NO_MODEL: "the robot has confirmed no model of this task: send it first",
    Code.NO_SUCH_MODEL: "the robot has no model {model}: send it first",
    Code.MODEL_DIFFERS: "the robot has another model than the one shown here: press Send model first",
    Code.MODEL_OF_OTHER_TASK: "model {model} is for {of:quoted}, not for {task:quoted}",
    Code.NOT_SEEN: "the robot has not seen the target for {unseen_s:.1f} s",
    Code.NOT_SEEN_YET: "the robot sees no target yet",
    Code.CANNOT_START: "the model cannot be executed from here: {text}",
    Code.CLUTCH_FIRST: "this task is previewed before it is executed: clutch and preview first",
    Code.NOT_PREVIEWED: "the robot executes only what was previewed: press Preview first",
    Code.NO_SUCH_PLAN: "there is no plan {plan}: preview again",
    Code.OTHER_MODEL_PREVIEWED: "the model is not the one that was previewed: preview again",
    Code.MOVED_SINCE: "the {what} moved {moved_m:mm} since the preview: preview again",
    Code.TURNED_SINCE: "the {what} turned {turned_rad:deg} since the preview: preview again",
    Code.PREVIEW_TOO_OLD: "the preview is {age_s:.0f} s old: preview again",
    Code.IN_RECEPTACLE: "the plug is in the receptacle: retract it first",
    Code.WAY_OUT_UNKNOWN: "the robot has not seen its receptacle: it does not know the way out",
    Code.OUT_OF_REACH: "the receptacle is out of the arm's reach: it misses the way in by {missed_m:mm} and {missed_rad:deg}",
    Code.JOINTS_END: "the joints cannot follow the planned motion: after {share:.0f} % of it they miss it by {missed_m:mm} and "
    "{missed_rad:deg}; begin from a pose nearer to that of the demonstrations",
    Code.EITHER_WAY: "the demonstrations turn the tool by {turned_rad:deg} from here: it may turn either way round",
    Code.WRIST_STRAIGHT: "the wrist would be straight on the way in ({singular_value:.3f})",
    Code.WRIST_NEARLY_STRAIGHT: "the wrist is nearly straight on the way in ({singular_value:.3f})",
    Code.NOT_DELIVERED: "NOT DELIVERED: the robot did not answer",
    Code.NEVER_ENDED: "the robot never reported its end",
    # Requests to the operator's own site
    Code.NOTHING_TO_UNDO: "no demonstration can be undone",
    Code.NOTHING_TO_RECOVER: "no demonstration can be recovered",
    Code.NOTHING_TAUGHT: "nothing was learned yet: record a demonstration first",
    Code.NO_SUCH_REVISION: "revision {number:.0f} is not kept any more",
    Code.CURRENT_REVISION: "revision {number:.0f} is the current one: choose another one first",
    Code.NO_SUCH_DEMONSTRATION: "this demonstration is not in the current revision any more: choose another one",
    Code.NO_SUCH_TASK: "no task {task:quoted} is known here, only {has}",
    Code.ROBOT_EXECUTES: "the robot executes {task}: end that first, by Clutch or Abort",
    Code.NO_OWN_ARM: "no arm is on a board, only a hand",
    Code.NO_OTHER_PLACE: "this task has one place for its frames (spread_m in its file makes others)",
    Code.HAND_DRIVES: "your hand drives the robot: clutch first",
    Code.NOT_BEFORE_MOUTH: "the plug is on the axis already, or too far from the mouth: drag it in front of the mouth first",
    Code.HAS_IT: "the robot has it already",
    Code.IN_CONTROL: "you are in control already",
    Code.NOBODY_ASKS: "nobody asks for the control",
    # Models
    Code.HASH_DIFFERS: "model: sha256: {announced} was announced, {arrived} arrived",
    Code.MODEL_MALFORMED: "model: {field}: {text}",
    Code.POSES_WANTED: "the task needs poses; these are positions",
    Code.POSITIONS_WANTED: "the task needs positions; these are poses",
    Code.OTHER_SIZE: "the task has {n_dims:.0f} dimensions and {n_frames:.0f} frames, this model {model_dims:.0f} and "
    "{model_frames:.0f}",
    Code.OTHER_FRAMES: "the frames of task {task:quoted} are {ours:quoted}; the model was learned in {theirs:quoted}",
    Code.NO_END: "the model has no terminal component: end a demonstration first",
    Code.TOO_LARGE: "model: {field}: at most {limit:g} {unit}, got {largest:.3g}",
    Code.VARIANCE: "model: {field}: variances from {least_allowed:g} to {most_allowed:g}, got {least:.3g} to {most:.3g}",
    Code.CONDITION: "model: {field}: a condition number of at most {limit:g}, got {condition:.3g}",
    Code.NOT_A_MOTION: "the model leads nowhere: its motion is not finite",
    # The camera
    Code.NO_CAMERA: "this robot has no camera",
    Code.CAMERA_STARTS: "the camera starts",
    Code.CAMERA_FAILED: "{text}",
    Code.LINK_NARROW: "the link carries {rate_kbps:.3g} kbit/s, pictures need {least_kbps:g}",
    # Ends of commands, and other events
    Code.DONE: "done",
    Code.RESUMED: "resumed",
    Code.COUPLED: "coupled",
    Code.PACE: "the pace is {pace:.0%}",
    Code.EXECUTING: "executing {model}",
    Code.AT_END: "{phase} after {elapsed_s:.2f} s",
    Code.MANOEUVRE_ENDED: "{phase} ended",
    Code.MANOEUVRE_GAVE_UP: "{phase} ended before its goal was reached",
    Code.HOLDS_AFTER: "{phase} ended, after: {cause}",
    Code.PREVIEWED: "previewed {motion_s:.1f} s of motion, {model}",
    Code.PREVIEWED_WITH_WARNING: "previewed {motion_s:.1f} s of motion, {model}; {cause}",
    Code.REPLACED: "replaced by a newer preview",
    Code.OVERTAKEN: "{action} came before the robot stood still",
    Code.ENDED_BY: "ended by {action}",
    Code.STOPPED_BY: "stop by {site}",
    Code.PLAN_FAILED: "the plan failed: {text}",
    Code.INTERRUPTED: "the execution of {model} was interrupted by a restart of the robot",
    Code.SUSPENDED: "the robot's computer was suspended for {suspended_s:.1f} s: it restarts, DISARMED",
    Code.PLACE_NOT_KEPT: "the robot's position could not be saved: it starts at its initial position",
    Code.PLACE_NOT_UNDERSTOOD: "the saved position of the robot is not understood ({file}): it starts at its initial position",
    Code.LISTENER_DROPPED: "{text}",
    # Recordings by the robot
    Code.RECORDING_ALREADY: "a motion is being recorded already",
    Code.NOT_RECORDING: "nothing is being recorded: press Record first",
    Code.RECORDED: "recorded after {recorded_s:.1f} s: {cause}",
    Code.RECORDING_INTERRUPTED: "interrupted after {recorded_s:.1f} s: {cause}; it can be recovered",
    Code.RECORDING_INCOMPLETE: "incomplete after {recorded_s:.1f} s: {cause}; it is not kept",
    Code.NOTHING_RECORDED: "nothing recorded: {cause}",
    Code.SAMPLE_MISSING: "{gap_s:.2f} s without a sample",
    Code.RECORDING_TOO_LONG: "it is longer than {limit_s:g} s",
    # Guards
    Code.DRAG_ENDED: "the drag ended",
    Code.NO_INPUT: "there was no input for {limit_s:.0f} s",
    Code.LEASE_LOST: "the lease was lost",
    Code.DELAY_CHANGED: "link delay changed",
    Code.SILENCE: "nothing new was heard from the operator for {limit_s:.2g} s longer than usual",
    Code.FORCE: "the force of {force_n:.0f} N is above {limit_n:.0f} N",
    Code.JAMMED: "jammed too often",
    Code.TARGET_LOST: "perception lost: the target was not seen for {limit_s:.0f} s",
    Code.TARGET_MOVED: "perception lost: the target came back {moved_m:mm} off",
    Code.TARGET_TURNED: "perception lost: the target came back turned by {turned_rad:deg}",
    Code.LINK_LOST: "the link has been lost for {silent_s:.1f} s: this task then {policy}",
    Code.BLIND_AND_ALONE: "for a minute neither the target was seen nor the operator heard",
    Code.LOOP_LATE: "the control loop was {late_s:ms} late",
    Code.LOOP_FAILED: "the control loop failed: {text}",
    Code.NOT_FINITE_MEASURED: "a measured number is not finite, or beyond a million",
    Code.NOT_FINITE_COMPUTED: "a computed number is not finite",
    Code.MEASUREMENT_WRONG: "a measurement is wrong: {text}",
    Code.CANNOT_MOVE: "the robot cannot be moved: {text}",
    Code.MACHINE_FAULT: "the robot's machine reports a fault: {text}",
    Code.STANDS_STILL: "the robot stands still for {still_s:.0f} s although it is told to move",
}
"""Sentence for each code."""

PRESS_AGAIN = frozenset({Code.TOO_OLD, Code.NO_ECHO, Code.OTHER_BOOT, Code.NEVER_SENT, Code.NOT_DELIVERED})
"""Momentary refusals: a second press is likely to succeed."""


def sentence(reason: Reason | None, cause: Reason | None = None) -> str:
    """Return a reason in words; empty for none.

    Args:
        reason: Reason. One whose code or values are unknown here is shown as received.
        cause: Reason behind it, if its sentence has room for one.
    """
    if reason is None:
        return ""
    values = _values(reason)
    n_more = values.pop(N_MORE, None)
    try:
        said = WORDS[Code(reason.code)].format_map({**values, "cause": sentence(cause)})
    except (ValueError, LookupError, TypeError):
        said = _as_it_came(reason, cause)
    return f"{said} (and {n_more:.0f} more like it)" if n_more else said


class _Number(float):
    """Number with the formats of the sentences."""

    def __format__(self, spec: str) -> str:
        match spec:
            case "mm":
                return f"{1e3 * self:.0f} mm"
            case "ms":
                return f"{1e3 * self:.0f} ms"
            case "deg":
                return f"{math.degrees(self):.0f} degrees"
        return format(float(self), spec)


class _Names(tuple[str, ...]):
    """One or several names with the formats of the sentences."""

    def __format__(self, spec: str) -> str:
        match spec:
            case "quoted":
                return " and ".join(map(repr, self))
            case "upper":
                return self[0].upper()
            case "modes":
                return modes_allowing(Action(self[0]))
        return " and ".join(self)


def _values(reason: Reason) -> dict[str, _Number | _Names]:
    values: dict[str, _Number | _Names] = {}
    for each in reason.values:
        if isinstance(each.value, str):
            before = values.get(each.name)
            values[each.name] = _Names((*(before if isinstance(before, _Names) else ()), each.value))
        else:
            values[each.name] = _Number(each.value)
    return values


def _as_it_came(reason: Reason, cause: Reason | None) -> str:
    """Describe a reason of another version: its code, its values, its cause."""
    values = [
        f"{each.name} {each.value if isinstance(each.value, str) else format(each.value, 'g')}"
        for each in reason.values
    ]
    about = f" ({', '.join(values)})" if values else ""
    return f"{reason.code}{about}" + (f": {sentence(cause)}" if cause is not None else "")
