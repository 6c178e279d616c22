"""Checks by the console before it asks the robot, with an immediate reason for a refusal."""

from __future__ import annotations

from farhand.common.control_mode import Action, mode_after, modes_allowing
from farhand.common.wire.messages import Telemetry
from farhand.local_site.console import intents
from farhand.local_site.console.picture import Picture
from farhand.local_site.teaching.lesson import NotNow


def check(intent: intents.CommandRobot, picture: Picture) -> Telemetry:
    """Check that a command may be sent now.

    The robot decides again on its own; this check only spares the operator a round trip.

    Args:
        intent: Command that the operator asks for; a stop is never refused and does not come here.
        picture: Present state of the console.

    Returns:
        The report that the command was checked against.

    Raises:
        NotNow: With the reason.
    """
    action, robot = intent.action, picture.robot
    if robot is None:
        raise NotNow("the robot has not reported yet")
    if intent.shown_mode is not None and intent.shown_mode is not robot.mode:
        shown, present = intent.shown_mode.name, robot.mode.name
        raise NotNow(f"page was behind: it showed {shown}, the robot is in {present}")
    if action in picture.pending:
        raise NotNow(f"{action} is under way already")
    if action is Action.RESET and picture.stop is not None and not picture.stop.settled:
        raise NotNow("your own stop is not acknowledged yet")
    if mode_after(robot.mode, robot.phase, action) is None:
        raise NotNow(f"{action} is not allowed in {robot.mode.name}, only in {modes_allowing(action)}")
    if action in (Action.PREVIEW, Action.EXECUTE) and not picture.confirmed_sha256:
        raise NotNow("the robot has confirmed no model: send it first")
    if action in (Action.PREVIEW, Action.EXECUTE) and picture.standing.differs:
        raise NotNow("the robot has another model than the one shown here: press Send model first")
    if action is Action.EXECUTE and picture.task.require_preview and not picture.plan_id:
        raise NotNow("the robot executes only what was previewed: press Preview first")
    if action is Action.COUPLE and picture.recording:
        raise NotNow("a demonstration is being recorded: end or undo it first")
    return robot
