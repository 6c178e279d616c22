"""Advice to the operator: the next step, what a preview will do, and why the last request was refused."""

from __future__ import annotations

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.model.way import OUTSIDE, chosen_way
from farhand.common.task import ArmTask
from farhand.common.wire.motion_encoding import points_of
from farhand.common.wire.reason_words import PRESS_AGAIN
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.report_age import LinkHealth
from farhand.local_site.view.panels.words.status import without_link_words
from farhand.local_site.view.panels.words.tasks import TaskWords, words_of
from farhand.local_site.view.scene.ghost import is_cut, preview_miss
from farhand.local_site.workcell.hand_motion import can_centre

_REFUSAL_S = 12.0
_IN_BORE_M, _BOTTOM_M, _THERE_M = 0.015, 0.010, 0.002
"""A plug at most so far beside the axis is before the mouth, or in the bore; what stops it near the bottom is no jam, and
so near it there is nothing left to push [m]."""
_WITHOUT_LINK = {
    "continue": "also without the link",
    "hold": "and pauses without the link",
    "retract": "and retracts without the link",
}
_ASKED = frozenset(map(str, Action)) | {
    "record", "end", "undo", "load samples", "samples", "recover", "go to", "start anew", "delete", "delete demonstration", "upload", "send model",
    "send library", "new place", "align", "centre", "step",
}  # fmt: skip
"""Names of the operator's requests in notices."""


def refusal(state: ConsoleState) -> str:
    """Return the reason why the operator's last request was refused, if that is recent; empty otherwise."""
    for notice in reversed(state.notices):
        if state.now_s - notice.time_s > _REFUSAL_S:
            return ""
        if notice.what in _ASKED and not notice.who:
            again = " Press it again." if notice.code in PRESS_AGAIN else ""
            return "" if notice.good else f"{str(notice.what).capitalize()}: {notice.text}.{again}"
    return ""


def advice(state: ConsoleState) -> str:
    """Return the next step of the job, for a first-time user."""
    stop, words = state.stop, words_of(state.task)
    if stop is not None and stop.moves_again:
        return "The robot moves again after your stop: press STOP again if it must not."
    if stop is not None and not stop.settled:
        return "The stop is being resent until the robot confirms it."
    if state.other_schema:
        return "The robot runs another version: install the same Farhand on both sites. Only STOP reaches it."
    if state.mode is None:
        return "Wait for the robot's first report."
    if state.asked_by:
        return f"{state.asked_by} asks for the control of the robot: press Hand over, or go on."
    if state.link.health is LinkHealth.LOST and not state.recording:
        return f"Nothing new is heard of the robot: only STOP is sent, until it arrives. {without_link_words(state, words.target)}"
    if state.mode is ControlMode.STOPPED:
        return f"Stopped{_why_stopped(state)}. Press Reset when it is safe to go on."
    if state.recording:
        return _recording_advice(state, words)
    return _moving_advice(state, words) or _teaching_advice(state, words) or _executing_advice(state)


def _why_stopped(state: ConsoleState) -> str:
    """Return who or what has stopped the robot, where it has told that."""
    told = (notice.text for notice in reversed(state.notices) if notice.what == "stopped")
    return f": {why}" if (why := next(told, "")) else ""


def miss_words(state: ConsoleState) -> str:
    """Return how the demonstration in progress misses the goal, if it was to end there; empty otherwise."""
    if not state.miss or state.at_goal:
        return ""
    return f"Not learned: it ends {state.miss}. Undo it, Keep anyway, or go on: "


def _recording_advice(state: ConsoleState, words: TaskWords) -> str:
    """Return the next step of a demonstration; with a plug, by its place."""
    arm, task = state.own_arm, state.task
    if arm is None or not isinstance(task, ArmTask):
        return f"{words.teach}, then press End."
    inserts = task.skill == "insert"
    if state.at_goal:
        return "Seated: press End." if inserts else "Out of the receptacle: press End."
    if not inserts:
        return f"{words.teach}, or hold the key K, then press End."
    if arm.depth_m > 0.0 and arm.lateral_m < _IN_BORE_M:
        left_m = max(arm.bore_m - arm.depth_m, 0.0)
        if left_m < _THERE_M:
            return "At the bottom: let go. Once the plug stands still, End turns green."
        jams = arm.saturated and left_m > _BOTTOM_M
        push = f"Push on, by the blue arrow or the key I: {1e3 * left_m:.0f} mm to go."
        return f"It jams: press Align first. {push}" if jams else push
    if can_centre(arm):
        return "Press Centre: it brings your plug before the mouth of the receptacle, along the bore."
    if arm.depth_m <= 0.0 and arm.lateral_m < _IN_BORE_M:
        return "On the axis: hold the key I, or drag the blue arrow, until the plug is seated."
    return f"{words.teach}. Once it is near the mouth, Centre does the rest of the way to the axis."


def _moving_advice(state: ConsoleState, words: TaskWords) -> str:
    """Return the advice during a motion of the robot, also a paused one."""
    match state.mode:
        case ControlMode.DIRECT if state.robot_records:
            return f"{words.drive}: the robot follows and records. Press End at the end of the motion."
        case ControlMode.DIRECT:
            return f"{words.drive}: the robot follows; press Record first to teach by it. Let go to decouple."
        case ControlMode.PAUSED:
            return "Paused, and kept. Press Resume to go on, or Abort."
        case ControlMode.AUTONOMOUS if state.phase.at_end:
            return f"{str(state.phase).capitalize()}: it tracks {words.target}. {words.arrived}"
        case ControlMode.AUTONOMOUS if state.phase is not Phase.APPROACHING:
            return f"The robot is {state.phase}. Abort ends it where it is."
        case ControlMode.AUTONOMOUS:
            return f"The robot executes the model on its own, {_WITHOUT_LINK[state.task.lost_link]}. Abort ends it."
    return ""


def _teaching_advice(state: ConsoleState, words: TaskWords) -> str:
    learned = state.learned
    if not state.standing.robot_does:
        return f"This robot does not do {state.task.name}: choose another task under Library."
    if learned is None and state.can_recover:
        return "A demonstration was broken off: press Recover to learn it, or Record another one."
    if learned is None:
        return f"Teach: press Record and {words.recording}, or press Load samples."
    if state.sending_model:
        return "The model is on its way: wait until the robot confirms it."
    if learned.sha256 != state.confirmed_sha256:
        return "Press Send model, or Record another demonstration first."
    return ""


def _executing_advice(state: ConsoleState) -> str:
    if state.mode is ControlMode.DISARMED:
        return "The robot has the model. Press Arm."
    if not state.plan_id and state.task.require_preview:
        return "Press Preview: the robot executes only what was previewed. Or Couple to drive by hand."
    if not state.plan_id:
        return "Press Preview to see the plan, Execute to run it, or Couple to drive by hand."
    if preview_miss(state):
        return "Press Record to demonstrate again; Execute would run what is drawn."
    return f"{plan_words(state)}Press Execute to run the model, or Couple to drive by hand."


def preview_miss_words(state: ConsoleState) -> str:
    """Return how the shown preview misses the task's goal; empty if it reaches the goal."""
    miss = preview_miss(state)
    return f"This preview ends {miss}, not at the task's goal. " if miss else ""


def plan_words(state: ConsoleState) -> str:
    """Return which way the preview takes and why, and whether it begins outside the demonstrated region."""
    path, learned = state.path, state.learned
    if (
        path is None
        or learned is None
        or path.plan_id != state.plan_id
        or path.model_sha256 != learned.sha256
    ):
        return ""
    model = learned.model
    if path.away > OUTSIDE:
        where = "starts"
        if path.away_frame < len(names := model.frame_names) > 1:
            where = f"starts or ends, seen from {names[path.away_frame]},"
        return (
            f"This path {where} {path.away:.0f} times further away than your demonstrations: watch it first. "
        )
    points = points_of(path)
    if is_cut(path):
        return f"The preview shows the first {(len(points) - 1) * path.step_s:.0f} s of a longer motion. "
    start = points[0]
    number = chosen_way(model.ways, start, model.max_distance_m)
    if number < 0:
        return "No demonstrated way is sure of this start: the robot joins the nearest component. "
    shown, others = model.ways[number].n_demonstrations, len(model.ways)
    which = f"way {number + 1} of {others}, the likeliest from here" if others > 1 else "the demonstrated way"
    return f"The plan takes {which} ({shown} demonstration{'s' * (shown != 1)}). "
