"""The models that the remote site has received: decoded, checked, confirmed by their hash."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

from farhand.common.errors import InvalidModel
from farhand.common.model.model_file import content_hash, decode
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.repertoire import Repertoire
from farhand.common.task import AnyTask
from farhand.common.wire.messages import ModelReply, ModelTransfer, Stamp

_MOST_ARRIVING = 4
"""So many models may arrive in parts at a time; the one that was heard of least recently begins anew."""


@dataclass(frozen=True)
class StoredModel:
    """A verified model.

    Args:
        sha256: Of the bytes that arrived.
        model: What they say.
        task: What it was sent for.
    """

    sha256: str
    model: TPHSMM
    task: AnyTask

    @property
    def label(self) -> str:
        """In words: its task, and the first digits of its hash."""
        return f"{self.task.name} {self.sha256[:8]}"


class ModelStore:
    """Keeps what fits its task; what does not fit changes nothing.

    Args:
        tasks: What this robot does.
    """

    def __init__(self, tasks: Repertoire):
        self._tasks = tasks
        self._models: dict[str, StoredModel] = {}
        self._arriving: OrderedDict[str, bytearray] = OrderedDict()
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
        task = self._task_of(transfer)
        model = decode(content)
        if model.manifold.oriented != task.space.oriented:
            kinds = ("positions", "poses")[:: -1 if model.manifold.oriented else 1]
            raise InvalidModel("model", "means", f"{kinds[1]}, as the task has; these are {kinds[0]}")
        if (model.n_dims, model.n_frames) != (task.space.n_dims, len(task.frame_names)):
            expected = f"{task.space.n_dims} dimensions and {len(task.frame_names)} frames"
            raise InvalidModel("model", "means", f"{expected}, got {model.n_dims} and {model.n_frames}")
        if not model.terminal.any():
            raise InvalidModel("model", "terminal", "a component where a demonstration ended; end one first")
        stored = StoredModel(sha256, model, task)
        self._models[sha256] = self.newest = stored
        return stored

    def answer(self, transfer: ModelTransfer, now: Stamp) -> ModelReply:
        """Receive a model or a part of one, and confirm it by its hash, or say why not.

        A part without content asks whether the model is here already.
        """
        sha256 = transfer.sha256
        try:
            complete, received = self._take(transfer)
        except InvalidModel as error:
            self._arriving.pop(sha256, None)
            return ModelReply(accepted=False, sha256=sha256, reason=str(error)[:500], stamp=now)
        return ModelReply(accepted=True, sha256=sha256, complete=complete, received=received, stamp=now)

    def _take(self, transfer: ModelTransfer) -> tuple[bool, int]:
        """Whether all of the model is here, and how many bytes of it are."""
        task, known = self._task_of(transfer), self._models.get(transfer.sha256)
        if transfer.size and known is not None and known.task is task:
            self.newest = known
            return True, transfer.size
        content = self._so_far(transfer)
        if len(content) < transfer.size:
            return False, len(content)
        self.receive(transfer, content)
        self._arriving.pop(transfer.sha256, None)
        return True, len(content)

    def _task_of(self, transfer: ModelTransfer) -> AnyTask:
        task = self._tasks.get(transfer.task)
        if task is None:
            raise InvalidModel("model", "task", self._tasks.refusal(transfer.task))
        return task

    def _so_far(self, transfer: ModelTransfer) -> bytes:
        """What has arrived of a model, this part included."""
        if not transfer.size:
            return transfer.content
        arrived = self._arriving.setdefault(transfer.sha256, bytearray())
        self._arriving.move_to_end(transfer.sha256)
        if len(self._arriving) > _MOST_ARRIVING:
            self._arriving.popitem(last=False)
        if transfer.offset == len(arrived) and len(arrived) + len(transfer.content) <= transfer.size:
            arrived += transfer.content
        return bytes(arrived)

    def all(self) -> list[StoredModel]:
        """Every verified model."""
        return list(self._models.values())

    def get(self, sha256: str) -> StoredModel | None:
        """The verified model with this hash, or None."""
        return self._models.get(sha256)
