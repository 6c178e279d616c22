"""Admission of commands: checks lease, age, mode, model and plan; runs a command at most once in a boot.

Reception of models: only the holder's, only whole ones, only those that can be executed.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable

import numpy as np

from farhand.common.command_refusal import Situation, refusal
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.task import TaskSet
from farhand.common.wire.messages import Command, CommandReply, ModelReply, ModelTransfer, Stamp
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.interface.embodiment import Skill
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.motion.execution import start_refusal
from farhand.remote_site.motion.model_store import ModelStore
from farhand.remote_site.motion.model_trial import ModelTrial, Outcome, StoredModel
from farhand.remote_site.motion.plans import Plans
from farhand.remote_site.supervision.event_log import Events
from farhand.remote_site.supervision.lease import Lease
from farhand.remote_site.supervision.operator_session import OperatorSession


class Admission:
    """Judge of commands, before they run.

    Args:
        tasks: Tasks of the robot.
        contact: The operator's lease and the age of its messages.
        models: Models received so far.
        plans: Previews.
        sensing: The newest measurements: pose of the robot, sight of its target.
        skill: The robot's skill; it may refuse commands from where the robot is.
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

    def refusal(self, command: Command, mode: ControlMode, phase: Phase, now: Stamp) -> Reason | None:
        """Return the reason why a command may not run, with the measured value; None if it may run."""
        why_not_in_control = self._contact.command_refusal(command)
        if command.action is Action.STOP:
            return why_not_in_control or because(Code.OWN_KEY)
        stored = self._models.get(command.model_sha256)
        situation = Situation(
            mode=mode,
            phase=phase,
            why_not_in_control=why_not_in_control,
            why_no_model=self._why_no_model(command, stored),
            is_previewed=command.plan_id > 0,
            needs_preview=stored is not None and stored.task.require_preview,
            can_retract=self._skill.task.retract_m is not None,
        )
        if (reason := refusal(command.action, situation)) is not None:
            return reason
        if command.action not in (Action.PREVIEW, Action.EXECUTE) or stored is None:
            return self._skill.refusal(command.action, self._sensing)
        return self._motion_refusal(command, stored, now)

    def _why_no_model(self, command: Command, stored: StoredModel | None) -> Reason | None:
        if (reason := self._tasks.refusal(command.task)) is not None:
            return reason
        if stored is None:
            return because(Code.NO_SUCH_MODEL, model=command.model_sha256[:8] or "(none named)")
        if stored.task.name != command.task:
            return because(
                Code.MODEL_OF_OTHER_TASK, model=stored.sha256[:8], of=stored.task.name, task=command.task
            )
        return None

    def _motion_refusal(self, command: Command, stored: StoredModel, now: Stamp) -> Reason | None:
        """Return the reason against a motion from here that only the robot can know; None without one."""
        if self._sensing.unseen_s > 0.0:
            unseen_s = self._sensing.unseen_s
            seen_before = bool(np.isfinite(unseen_s))
            return because(Code.NOT_SEEN if seen_before else Code.NOT_SEEN_YET, unseen_s=unseen_s)
        if (reason := start_refusal(stored, self._sensing.effector, self._sensing.frames)) is not None:
            return reason
        if command.action is Action.EXECUTE and stored.task.require_preview:
            situation = self._plans.situation(command.model_sha256, now)
            return self._plans.refusal(command.plan_id, situation, self._contact.usual_age_s)
        return None


_KEPT = 4096


class CommandLog:
    """Log of the answers of this boot, by command id."""

    def __init__(self) -> None:
        self._replies: OrderedDict[str, CommandReply] = OrderedDict()

    def reply_to(self, command_id: str) -> CommandReply | None:
        """Return the earlier answer to this command; None for a new command."""
        return self._replies.get(command_id)

    def remember(self, reply: CommandReply) -> None:
        """Keep an answer."""
        self._replies[reply.command_id] = reply
        if len(self._replies) > _KEPT:
            self._replies.popitem(last=False)


class ModelReception:
    """Receiver of models. While nobody is in control anybody may send one, else only the holder.

    Args:
        models: Store of the models.
        lease: Lease of the robot's control.
        events: Takes the refusals.
        mode: The present mode.
        now: The present stamp.
    """

    def __init__(
        self,
        models: ModelStore,
        lease: Lease,
        events: Events,
        mode: Callable[[], ControlMode],
        now: Callable[[], Stamp],
    ):
        self._models, self._lease, self._events, self._mode, self._now = models, lease, events, mode, now

    def take(self, transfer: ModelTransfer) -> ModelReply | ModelTrial:
        """Take a model or a part of one. Return the answer, or the trial that must run before it."""
        if self._lease.session not in ("", transfer.session):
            reason = because(Code.OTHER_IN_CONTROL, site=self._lease.holder)
            reply = ModelReply(accepted=False, sha256=transfer.sha256, reason=reason, stamp=self._now())
            return self._noted(reply)
        taken = self._models.take(transfer, self._now())
        return taken if isinstance(taken, ModelTrial) else self._noted(taken)

    def finish_trial(self, trial: ModelTrial, outcome: Outcome) -> ModelReply:
        """Keep a model that was tried with success; it becomes active with the next Execute that names it."""
        return self._noted(self._models.finish_trial(trial, outcome, self._now()))

    def _noted(self, reply: ModelReply) -> ModelReply:
        if not reply.accepted:
            self._events.refused("model", "", reply.reason, self._mode())
        return reply
