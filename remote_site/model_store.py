"""The models that the remote site has received: decoded, checked, confirmed by their hash."""

from __future__ import annotations

from dataclasses import dataclass

from common.errors import InvalidModel
from common.messages import ModelReply, ModelTransfer, Stamp
from common.model_file import content_hash, decode
from common.task import Task
from common.tphsmm import TPHSMM


@dataclass(frozen=True)
class StoredModel:
    """A verified model.

    Args:
        sha256: Of the bytes that arrived.
        model: What they say.
    """

    sha256: str
    model: TPHSMM


class ModelStore:
    """Keeps what fits the task; what does not fit changes nothing.

    Args:
        task: The task that this robot does.
    """

    def __init__(self, task: Task):
        self._task = task
        self._models: dict[str, StoredModel] = {}
        self._arriving: tuple[str, bytearray] = ("", bytearray())
        self.newest: StoredModel | None = None

    def receive(self, transfer: ModelTransfer, content: bytes) -> StoredModel:
        """Check and keep a model.

        Args:
            transfer: What was said of it.
            content: All of it.

        Raises:
            InvalidModel: When its hash, content, task or dimensions do not fit.
        """
        sha256 = content_hash(content)
        if sha256 != transfer.sha256:
            raise InvalidModel(
                "model", "sha256", f"{transfer.sha256[:8]} was announced, {sha256[:8]} arrived"
            )
        if transfer.task != self._task.name:
            raise InvalidModel("model", "task", f"{self._task.name!r}, got {transfer.task!r}")
        model = decode(content)
        if model.manifold.oriented != self._task.space.oriented:
            kinds = ("positions", "poses")[:: -1 if model.manifold.oriented else 1]
            raise InvalidModel("model", "means", f"{kinds[1]}, as the task has; these are {kinds[0]}")
        if (model.n_dims, model.n_frames) != (self._task.space.n_dims, len(self._task.frame_names)):
            expected = f"{self._task.space.n_dims} dimensions and {len(self._task.frame_names)} frames"
            raise InvalidModel("model", "means", f"{expected}, got {model.n_dims} and {model.n_frames}")
        if not model.terminal.any():
            raise InvalidModel("model", "terminal", "a component where a demonstration ended; end one first")
        stored = StoredModel(sha256, model)
        self._models[sha256] = self.newest = stored
        return stored

    def answer(self, transfer: ModelTransfer, now: Stamp) -> ModelReply:
        """Receive a model or a part of one, and confirm it by its hash, or say why not.

        A part without content asks whether the model is here already.
        """
        known = self._models.get(transfer.sha256)
        if known is not None and transfer.size and not transfer.content:
            self.newest = known
            return ModelReply(accepted=True, sha256=known.sha256, received=transfer.size, stamp=now)
        content = self._so_far(transfer)
        sha256, received = transfer.sha256, len(content)
        if received < transfer.size:
            return ModelReply(accepted=True, sha256=sha256, complete=False, received=received, stamp=now)
        try:
            stored = self.receive(transfer, content)
        except InvalidModel as error:
            self._arriving = ("", bytearray())
            return ModelReply(accepted=False, sha256=sha256, reason=str(error)[:500], stamp=now)
        return ModelReply(accepted=True, sha256=stored.sha256, received=received, stamp=now)

    def _so_far(self, transfer: ModelTransfer) -> bytes:
        """What has arrived of a model, this part included. Only one model arrives in parts at a time."""
        if not transfer.size:
            return transfer.content
        sha256, arrived = self._arriving
        if sha256 != transfer.sha256:
            self._arriving = (transfer.sha256, arrived := bytearray())
        if transfer.offset == len(arrived) and len(arrived) + len(transfer.content) <= transfer.size:
            arrived += transfer.content
        return bytes(arrived)

    def all(self) -> list[StoredModel]:
        """Every verified model."""
        return list(self._models.values())

    def get(self, sha256: str) -> StoredModel | None:
        """The verified model with this hash, or None."""
        return self._models.get(sha256)
