"""Admission of commands: checks lease, age, mode, model and plan; runs a command at most once in a boot."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np

from farhand.common.control_mode import Action, ControlMode, Phase, mode_after, modes_allowing
from farhand.common.repertoire import TaskSet
from farhand.common.wire.messages import Command, CommandReply, Stamp
from farhand.remote_site.interface.embodiment import Skill
from farhand.remote_site.motion.execution import start_refusal
from farhand.remote_site.motion.model_store import ModelStore
from farhand.remote_site.motion.plans import Plans
from farhand.remote_site.perception.sensing import Sensing
from farhand.remote_site.supervision.session import OperatorSession


class Admission:
    """Finds the reason against a command.

    Args:
        tasks: What the robot does.
        contact: The operator's lease and the age of its messages.
        models: What was received.
        plans: What was previewed.
        sensing: Whether the target is seen, and where the robot is.
        skill: What it can do from there.
    """

    def __init__(
        self,
        tasks: TaskSet,
        contact: OperatorSession,
        models: ModelStore,
        plans: Plans,
        sensing: Sensing,
        skill: Skill,
    ):
        self._tasks, self._contact, self._models = tasks, contact, models
        self._plans, self._sensing, self._skill = plans, sensing, skill

    def refusal(
        self, command: Command, mode: ControlMode, phase: Phase, now: Stamp
    ) -> tuple[str, float | None]:  # fmt: skip
        """Why a command may not run, with the measured value; an empty reason when it may."""
        reason, measured = self._contact.command_refusal(command)
        if reason:
            return reason, measured
        if command.action is Action.STOP:
            return "a stop travels on its own key", None
        if mode_after(mode, phase, command.action) is None:
            return (
                f"{command.action} is not allowed in {mode.name}, only in {modes_allowing(command.action)}",
                None,
            )
        if command.action in (Action.EXECUTE, Action.PREVIEW):
            return self._motion_refusal(command, mode, now)
        if command.action is Action.RETRACT and self._skill.task.retract_m is None:
            return "this task says nowhere to retract to (`retract_m`)", None
        return self._skill.refusal(command.action, self._sensing), None

    def _motion_refusal(
        self, command: Command, mode: ControlMode, now: Stamp
    ) -> tuple[str, float | None]:  # fmt: skip
        if reason := self._tasks.refusal(command.task):
            return reason, None
        stored = self._models.get(command.model_sha256)
        if stored is None:
            return f"the robot has no model {command.model_sha256[:8] or '(none named)'}: send it first", None
        if stored.task.name != command.task:
            return f"model {stored.sha256[:8]} is one of {stored.task.name!r}, not of {command.task!r}", None
        if self._sensing.unseen_s > 0.0:
            unseen_s = self._sensing.unseen_s
            since = (
                f"has not seen the target for {unseen_s:.1f} s"
                if np.isfinite(unseen_s)
                else "sees no target yet"
            )
            return f"the robot {since}", min(unseen_s, 1e6)
        if reason := start_refusal(stored, self._sensing.effector, self._sensing.frames):
            return reason, None
        if command.action is Action.EXECUTE and stored.task.require_preview:
            if mode is ControlMode.DIRECT:
                return "this task is previewed before it is executed: clutch and preview first", None
            situation = self._plans.situation(command.model_sha256, now)
            return self._plans.refusal(command.plan_id, situation, self._contact.usual_age_s)
        return "", None


_KEPT = 4096


class CommandLog:
    """The answers that were given, by command id."""

    def __init__(self) -> None:
        self._replies: OrderedDict[str, CommandReply] = OrderedDict()

    def reply_to(self, command_id: str) -> CommandReply | None:
        """The answer that this command got before, or None for a new one."""
        return self._replies.get(command_id)

    def remember(self, reply: CommandReply) -> None:
        """Keep an answer."""
        self._replies[reply.command_id] = reply
        if len(self._replies) > _KEPT:
            self._replies.popitem(last=False)
