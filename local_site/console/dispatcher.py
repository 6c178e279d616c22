"""Dispatcher of intents: each is judged by the one rule, and done by the part of the console that it is about."""

from __future__ import annotations

from collections.abc import Callable

from farhand.common.errors import FarhandError
from farhand.common.mode_table import Action
from farhand.common.wire.reasons import Code
from farhand.local_site.console import intents
from farhand.local_site.console.console_parts import ConsoleParts
from farhand.local_site.console.intent_permission import refusal_of
from farhand.local_site.console.teleoperation import Teleoperation
from farhand.local_site.exchange.notices import Notice
from farhand.local_site.teaching.teaching_permission import NotNow


class Dispatcher:
    """Dispatcher of the operator's intents, for use by the console's thread alone.

    Args:
        parts: Parts of the console.
        teleoperation: Sends the hand's movement to the robot.
        now_s: Clock of this site [s].
    """

    def __init__(self, parts: ConsoleParts, teleoperation: Teleoperation, now_s: Callable[[], float]):
        self._parts, self._teleoperation, self._now_s = parts, teleoperation, now_s

    def do(self, intent: intents.Intent) -> None:
        """Do an intent, or tell the operator why it is not possible now."""
        parts = self._parts
        try:
            match intent:
                case intents.Hand():
                    self._hand(intent)
                case intents.DragTarget(to_m):
                    self._teleoperation.move_target(to_m, parts.reports.robot, parts.commanding.lease_id)
                case intents.CommandRobot(Action.STOP | Action.ABORT as action):
                    parts.teaching.roll_back(f"{action} was pressed")
                    self._do_if_allowed(intent)
                case _:
                    self._do_if_allowed(intent)
        except FarhandError as error:
            code = error.reason.code if isinstance(error, NotNow) and error.reason.code != Code.OTHER else ""
            parts.notices.add(Notice(self._now_s(), intent.label, f"refused: {error}", good=False, code=code))

    def _do_if_allowed(self, intent: intents.Intent) -> None:
        parts, state = self._parts, self._parts.draw(self._now_s())
        if (why := refusal_of(intent, state)) is not None:
            raise NotNow(why)
        if (action := parts.catalogue.recordings.action_for(intent, state)) is not None:
            intent = intents.CommandRobot(action)
        match intent:
            case intents.CommandRobot():
                self._teleoperation.end_drag()
                self._command(intent)
            case intents.WishControl(wish):
                parts.commanding.wish(wish)
            case intents.WatchCamera(on):
                parts.camera.want(on)
            case intents.Choose(task):
                parts.teaching.choose(task)
                parts.reports.forget_plan()
            case intents.SendModel() | intents.SendLibrary() | intents.AutoSend():
                parts.sending.do(intent)
            case intents.Recover() if parts.teaching.left_over is None:
                parts.catalogue.recordings.recover()
            case intents.Hand() | intents.DragTarget():
                pass  # done before: they are frequent, and nothing is judged but the coupling
            case _:
                parts.teaching.do(intent)

    def _command(self, intent: intents.CommandRobot) -> None:
        parts, action, robot = self._parts, intent.action, self._parts.reports.robot
        if action is Action.STOP or robot is None:
            return  # a stop is sent by its own lane
        parts.stop.commanded(action)
        task = parts.library.task.name
        sha256 = parts.models.confirmed_sha256(task)
        parts.commanding.command(
            action, robot, self._now_s(), task, sha256, parts.reports.plan_id, intent.pace
        )

    def _hand(self, intent: intents.Hand) -> None:
        """Let the hand drive the robot while coupled; otherwise let it move the workcell."""
        parts, robot = self._parts, self._parts.reports.robot
        lease_id = parts.commanding.lease_id
        drives = robot is not None and lease_id and not parts.library.recording
        coupling = robot.coupling_id if robot is not None and drives else 0
        goes_on = self._teleoperation.goes_on(coupling, intent.released)
        if robot is not None and coupling and goes_on:
            self._teleoperation.hand(intent.point, intent.released, robot, lease_id)
        elif goes_on or intent.released:
            parts.place.hand(intent.point, intent.time_s, intent.released)
