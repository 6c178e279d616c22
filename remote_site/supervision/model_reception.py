"""Receives models: whose they are, whether they are whole, whether they can be executed."""

from __future__ import annotations

from collections.abc import Callable

from farhand.common.control_mode import ControlMode
from farhand.common.wire.messages import ModelReply, ModelTransfer, Stamp
from farhand.common.wire.reasons import Code, because
from farhand.remote_site.motion.model_store import ModelStore
from farhand.remote_site.motion.model_trial import ModelTrial, Outcome
from farhand.remote_site.supervision.events import Events
from farhand.remote_site.supervision.lease import Lease


class ModelReception:
    """Answers who sends models. While the robot is free anybody may send one, else its holder alone.

    Args:
        models: Keeps them.
        lease: Who is in control.
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
        """Take a model or a part of one: the answer, or what must be tried before there is one."""
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
