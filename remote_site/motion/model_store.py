"""Store of received models: assembled from their parts, tried, confirmed by their hash."""

from __future__ import annotations

from collections import OrderedDict

from farhand.common.task import TaskSet
from farhand.common.wire.messages import ModelReply, ModelTransfer, Stamp
from farhand.common.wire.reasons import Reason
from farhand.remote_site.motion.model_trial import ModelRefused, ModelTrial, Outcome, StoredModel

_MOST_ARRIVING = 4
"""Largest number of models in reception at a time; the least recently received one is dropped."""
_MOST_KEPT = 32
"""Number of models kept, the newest; an older one is sent again when needed."""


class ModelStore:
    """Store of models that fit their task; a model that does not fit changes nothing.

    Args:
        tasks: Tasks of this robot.
    """

    def __init__(self, tasks: TaskSet):
        self._tasks = tasks
        self._models: dict[str, StoredModel] = {}
        self._arriving: OrderedDict[str, bytearray] = OrderedDict()
        self.newest: StoredModel | None = None

    def answer(self, transfer: ModelTransfer, now: Stamp) -> ModelReply:
        """Receive a model or a part of one; try a complete one; return its confirmation or refusal."""
        taken = self.take(transfer, now)
        return self.finish_trial(taken, taken.outcome(), now) if isinstance(taken, ModelTrial) else taken

    def take(self, transfer: ModelTransfer, now: Stamp) -> ModelReply | ModelTrial:
        """Receive a model or a part of one.

        A part without content asks whether the robot has the model already.

        Returns:
            The answer, or the trial that must precede it (see `finish_trial`).
        """
        task = self._tasks.get(transfer.task)
        if task is None:
            return _refusal(transfer, self._tasks.refusal(transfer.task), now)
        known = self._models.get(transfer.sha256)
        if transfer.size and known is not None and known.task is task:
            self.newest = known
            return _reply(transfer, now, transfer.size)
        if not transfer.size:
            return ModelTrial(transfer, transfer.content, task)
        arrived = self._so_far(transfer)
        if len(arrived) < transfer.size:
            return _reply(transfer, now, len(arrived), complete=False)
        return ModelTrial(transfer, bytes(arrived), task)

    def finish_trial(self, trial: ModelTrial, outcome: Outcome, now: Stamp) -> ModelReply:
        """Keep a model whose trial succeeded, and answer."""
        self._arriving.pop(trial.transfer.sha256, None)
        if isinstance(outcome, ModelRefused):
            return _refusal(trial.transfer, outcome.reason, now)
        self._keep(outcome)
        return _reply(trial.transfer, now, len(trial.content))

    def _keep(self, stored: StoredModel) -> None:
        self._models.pop(stored.sha256, None)
        self._models[stored.sha256] = self.newest = stored
        if len(self._models) > _MOST_KEPT:
            del self._models[next(iter(self._models))]

    def _so_far(self, transfer: ModelTransfer) -> bytearray:
        """Return the arrived content of a model, this part included."""
        arrived = self._arriving.setdefault(transfer.sha256, bytearray())
        self._arriving.move_to_end(transfer.sha256)
        if len(self._arriving) > _MOST_ARRIVING:
            self._arriving.popitem(last=False)
        if transfer.offset == len(arrived) and len(arrived) + len(transfer.content) <= transfer.size:
            arrived += transfer.content
        return arrived

    def all(self) -> list[StoredModel]:
        """Return every verified model."""
        return list(self._models.values())

    def get(self, sha256: str) -> StoredModel | None:
        """Return the verified model with this hash, or None."""
        return self._models.get(sha256)


def _reply(transfer: ModelTransfer, now: Stamp, received: int, complete: bool = True) -> ModelReply:
    return ModelReply(accepted=True, sha256=transfer.sha256, complete=complete, received=received, stamp=now)


def _refusal(transfer: ModelTransfer, reason: Reason | None, now: Stamp) -> ModelReply:
    return ModelReply(accepted=False, sha256=transfer.sha256, reason=reason, stamp=now)
