"""Words about the robot's state: band at the top, alarm, card below the robot, and how long ago something was."""

from __future__ import annotations

import math

from farhand.common.link.fleet import RobotAtHub
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.wire.messages import Telemetry
from farhand.common.wire.reason_words import sentence
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.report_age import LinkHealth
from farhand.local_site.exchange.stop_sender import StopStatus
from farhand.local_site.view.history import Moment
from farhand.local_site.view.panels.words.tasks import TaskWords
from farhand.local_site.view.scene.ghost import Ghost, RobotPicture

LINK_WORDS = {
    LinkHealth.NEVER: "LOST",
    LinkHealth.OK: "OK",
    LinkHealth.LATE: "DEGRADED",
    LinkHealth.LOST: "LOST",
}
UNKNOWN, NOBODY, NO_PENDING, NO_REPORT = "UNKNOWN", "NOBODY", "none", "no report yet"
HOLDERS = {ControlMode.DIRECT: "OPERATOR", ControlMode.AUTONOMOUS: "REMOTE MPC"}
SHOWN_ROBOT, PAGE_OF = "the robot of this page", "the page of {name}"
_SILENT_S = 10.0
"""Age from which the newest report of another robot does not tell its mode any more [s]."""
_IF_LOST = {"continue": "goes on", "hold": "pauses", "retract": "retracts"}
_POLICY = {
    "continue": "its task lets an execution go on to its end without the link",
    "hold": "its task pauses an execution without the link",
    "retract": "its task has an execution retract without the link",
}
_MANOEUVRES = (Phase.RETRACTING, Phase.GOING_TO_READY, Phase.BACKING_OFF)
"""Phases in which the robot moves without executing a model: the task's policy for a lost link is not about them."""


def stop_words(stop: StopStatus, state: ConsoleState, ghost: Ghost | None, now_s: float) -> str:
    """Return the alarm about a stop that the robot has not confirmed, or that a site has undone."""
    waited_s = math.floor(now_s - stop.pressed_s)
    if stop.moves_again:
        return f"THE ROBOT MOVES AGAIN ({stop.reported.name if stop.reported else ''}): it stood for your stop and was reset"
    if stop.standing:
        return f"STOP RECEIVED, the robot stood; it has not reported since ({waited_s} s)"
    if stop.received:
        return f"STOP RECEIVED, the robot is braking ({waited_s} s)"
    return f"STOP NOT DELIVERED {waited_s} s{_last_known(state, ghost, now_s)}"


def _last_known(state: ConsoleState, ghost: Ghost | None, now_s: float) -> str:
    """Return what the robot did when it was last heard: its present state is unknown."""
    if state.mode is None or state.link.age_s is None:
        return ""
    heard_s = math.floor(state.link.age_s + now_s - state.now_s)
    end = (
        ""
        if ghost is None
        else ", by its plan done"
        if ghost.done
        else f", by its plan done in {math.ceil(ghost.left_s)} s"
    )
    return f": the robot was {state.mode.name} when last heard {heard_s} s ago{end}"


def stop_does_words(state: ConsoleState) -> str:
    """Return what STOP would do now, in a few words under its name."""
    stop = state.stop
    if state.link.health in (LinkHealth.LOST, LinkHealth.NEVER):
        return "sent until it arrives"
    if stop is not None and not stop.settled and not stop.moves_again:
        return "being sent"
    match state.mode:
        case ControlMode.STOPPED:
            return "stopped already"
        case ControlMode.DISARMED | ControlMode.HOLD | ControlMode.PAUSED:
            return "stands, and is locked"
        case ControlMode.AUTONOMOUS if state.phase.at_end:
            return "holds here, locked"
    return "brakes, holds, locked"


def counted(number: int, noun: str) -> str:
    """Return a noun in the number that fits."""
    return noun if number == 1 else f"{noun}s"


def depth_words(depth_mm: float) -> str:
    """Return the place of a plug in its receptacle, or before it."""
    return f"{depth_mm:.0f} mm deep" if depth_mm > 0.0 else f"{-depth_mm:.0f} mm away"


def seen_words(age: str, old: bool) -> str:
    """Return how long ago the robot was as it is shown."""
    return f"OLD: seen {age} ago" if old else f"seen {age} ago"


def left_words(seconds: int) -> str:
    """Return how long the preview is still good."""
    return f"preview: {max(seconds, 0)} s left"


def as_it_was_words(seconds: float) -> str:
    """Return of when the shown robot is, while the operator looks back."""
    return f"as it was {ago_words(seconds)}"


def fetching_words(share: float) -> str:
    """Return how much of the robot's drawing was fetched."""
    return f"fetching what the robot looks like, {share:.0%}"


def camera_age_words(age_s: float, old: bool) -> str:
    """Return how long ago a picture was exposed."""
    return f"OLD: {age_s:.0f} s ago" if old else f"{age_s:.1f} s ago"


def no_picture_words(why: str, waiting: bool) -> str:
    """Return why no picture of the robot's camera comes; empty if one is shown."""
    return f"no picture: {why}" if why else "waiting for a picture" if waiting else ""


def pace_words(state: ConsoleState) -> str:
    """Return the robot's pace, if it is reduced."""
    pace = state.robot.pace if state.robot is not None else 1.0
    return f"at {pace:.0%}" if pace < 0.995 else ""


def robot_words(state: RobotAtHub) -> tuple[str, str]:
    """Return what another robot at the hub does, in one or two words, with the style of its link."""
    if state.report is None or state.age_s > _SILENT_S:
        return ("silent" if state.is_there else "not at the hub"), "fh-robot-away"
    stopped = state.report.mode is ControlMode.STOPPED
    return state.report.mode.name, "fh-robot-stopped" if stopped else ""


def pending_words(state: ConsoleState, now_s: float) -> list[str]:
    """Return the commands that the robot has not finished, each with its age."""
    words = [f"{action} {math.floor(now_s - pending.since_s)} s" for action, pending in state.pending.items()]
    return [*words, "send model"] if state.sending_model else words


def lease_words(state: ConsoleState) -> str:
    """Return which site may command the robot."""
    if state.other_schema:
        return "another version"
    if state.in_control:
        return f"{state.asked_by} asks for it" if state.asked_by else "you have control"
    return sentence(state.why_not_in_control) or "asking for the robot"


def silence_words(state: ConsoleState, now_s: float) -> str:
    """Return what the robot does if the link is lost, by its present mode, or for how long it was silent."""
    link = state.link
    if link.health is not LinkHealth.OK and not math.isinf(link.silent_s):
        return f"silent for {math.floor(link.silent_s + now_s - state.now_s)} s"
    if state.mode is ControlMode.AUTONOMOUS:
        return f"if lost: {'goes on' if state.phase in _MANOEUVRES else _IF_LOST[state.task.lost_link]}"
    return f"if lost: {'holds' if state.mode is ControlMode.DIRECT else 'stands'}" if state.mode else ""


def without_link_words(state: ConsoleState, target: str) -> str:
    """Return what the robot was doing when last heard, and what that becomes without the link; empty before a report.

    Args:
        state: State of the console.
        target: Name of the robot's target.
    """
    match state.mode:
        case None:
            return ""
        case ControlMode.AUTONOMOUS if state.phase in _MANOEUVRES:
            becomes = "this ends without the link as with it, and the robot holds then"
        case ControlMode.AUTONOMOUS if state.phase.at_end and state.task.lost_link == "continue":
            becomes = f"without the link it stays there and tracks {target}"
        case ControlMode.AUTONOMOUS:
            becomes = _POLICY[state.task.lost_link]
        case ControlMode.DIRECT:
            becomes = "without the link no hand moves it, and it holds"
        case ControlMode.PAUSED if state.task.blind_retract:
            becomes = "it stays so, but retracts after a minute without sight of its target"
        case _:
            becomes = "it stays so without the link"
    was = f"{state.mode.name}, {state.phase}" if state.phase else state.mode.name
    sent = ", ".join(action for action in state.pending if action is not Action.STOP)
    return (
        f"When last heard it was {was}: {becomes}.{f' It may have received since: {sent}.' if sent else ''}"
    )


def model_words(state: ConsoleState) -> str:
    """Return whether the robot has the learned model."""
    if state.learned is None:
        return ""
    if state.confirmed_sha256 == state.learned.sha256:
        return ", robot has it"
    if state.standing.asking:
        return ", asking the robot"
    return ", on its way" if state.sending_model else ", robot lacks it"


def recording_words(state: ConsoleState) -> str:
    """Return the progress of a demonstration that the robot records."""
    if state.recorded_s is not None:
        return f" · recording on the robot {math.floor(state.recorded_s)} s"
    return "" if state.fetching is None else f" · fetching {state.fetching:.0%}"


def motion_words(robot: Telemetry, ghost: Ghost | None, words: TaskWords) -> str:
    """Return what the robot is doing, and when it should be done."""
    if robot.waiting:
        return " · waiting for input"
    if robot.phase.at_end:
        return f" · {robot.phase}, tracking {words.target}"
    on_way = robot.mode is ControlMode.AUTONOMOUS and robot.component < 0 and robot.phase is Phase.APPROACHING
    way = " · on the demonstrated way" if on_way else ""
    if ghost is None:
        return way
    return f"{way} · expected done" if ghost.done else f"{way} · {math.ceil(ghost.left_s)} s to go"


def error_words(picture: RobotPicture) -> str:
    """Return the distance of the ghost from the pose that the robot then reported; empty while it is unknown."""
    return "" if picture.error_m is None else f"ghost {1e3 * picture.error_m:.0f} mm off"


def ago_words(seconds: float) -> str:
    """Return how long ago something was, as text."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    parts = ((hours, "h"), (minutes, "min"), (rest if not hours else 0, "s"))
    return f"{' '.join(f'{n} {unit}' for n, unit in parts if n) or '0 s'} ago"


def past_words(then: Moment, now_s: float) -> str:
    """Return the mark over a picture of the robot that is not of now."""
    force = f", {then.force_n:.0f} N" if then.force_n is not None else ""
    old = "" if then.heard or then.age_s is None else f", {then.age_s:.0f} s old already"
    return f"{ago_words(now_s - then.time_s)}, not now: {then.mode or 'no report yet'}{force}{old}"
