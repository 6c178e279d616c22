"""The learned model on its way to the robot: it counts only when the robot has confirmed its hash."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from common import keys
from common.budget import part_bytes
from common.messages import ModelReply, ModelTransfer
from local_site.commanding import Notify
from local_site.inquiries import Inquiries
from local_site.notices import Notice
from local_site.taught import LearnedModel

_GIVE_UP_S = 600.0


class ModelSender:
    """Sends the newest model until it is confirmed. Used by the console's thread alone.

    Args:
        inquiries: Asks the robot.
        task: Name of the task that the models are for.
        notify: Tells the operator.
        now_s: The console's clock.
        rate_bps: What the link carries [bit/s], 0 for more than enough: how large the parts are.
    """

    def __init__(
        self,
        inquiries: Inquiries,
        task: str,
        notify: Notify,
        now_s: Callable[[], float],
        rate_bps: float = 0.0,
    ):
        self._inquiries, self._task, self._part_bytes = inquiries, task, part_bytes(rate_bps)
        self._notify, self._now_s = notify, now_s
        self._sending = ""
        self._began_s = 0.0
        self.newest_sha256 = ""
        """The model that was sent last, confirmed or not."""
        self.confirmed_sha256 = ""
        self._had: set[str] = set()  # what the robot had once; a restarted one may have it no more

    @property
    def sending(self) -> bool:
        """Whether a model is on its way."""
        return bool(self._sending)

    def send(self, learned: LearnedModel) -> None:
        """Send a model in the background, also through outages; a newer one takes the place of an older one.

        The robot is asked first whether it has it already, when that may be, or spares much.
        """
        if self._sending == learned.sha256:
            return
        self._sending = self.newest_sha256 = learned.sha256
        self._began_s = self._now_s()
        size = len(learned.content)
        asks = learned.sha256 in self._had or size > self._part_bytes
        self._send_part(learned, 0, 0 if asks else self._part_bytes)

    def _send_part(self, learned: LearnedModel, offset: int, n_bytes: int) -> None:
        size = len(learned.content)
        transfer = ModelTransfer(
            task=self._task,
            sha256=learned.sha256,
            version=learned.version,
            parent_sha256=learned.parent_sha256,
            size=size if size > n_bytes else 0,
            offset=offset,
            content=learned.content[offset : offset + n_bytes],
        )
        answered = partial(self._on_reply, learned)
        wanted = partial(self._is_newest, learned.sha256)
        self._inquiries.ask(keys.MODEL, transfer, ModelReply, _GIVE_UP_S, answered, wanted)

    def _is_newest(self, sha256: str) -> bool:
        return sha256 == self.newest_sha256

    def _on_reply(self, learned: LearnedModel, reply: ModelReply | None, _took_s: float) -> None:
        sha256 = learned.sha256
        if sha256 != self.newest_sha256:
            return  # a newer one is on its way, or there already
        if reply is not None and reply.accepted and not reply.complete and reply.sha256 == sha256:
            self._send_part(
                learned, reply.received, self._part_bytes
            )  # also after a robot's restart, which begins anew
            return
        self._sending = ""
        if reply is None:
            self._tell("NOT DELIVERED: the robot did not confirm the model", good=False)
        elif not reply.accepted or reply.sha256 != sha256:
            self._tell(f"refused: {reply.reason or 'the robot confirmed another model'}", good=False)
        else:
            self.confirmed_sha256 = sha256
            self._had.add(sha256)
            took_s = self._now_s() - self._began_s
            self._tell(f"the robot confirmed model {sha256[:8]} after {took_s:.2f} s", good=True)

    def _tell(self, text: str, good: bool) -> None:
        self._notify(Notice(self._now_s(), "send model", text, good))
