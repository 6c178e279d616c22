"""Sender of learned models: a model counts as sent only when the robot has confirmed its hash."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from farhand.common.link.budget import part_bytes
from farhand.common.wire import keys
from farhand.common.wire.messages import ModelReply, ModelTransfer
from farhand.common.wire.reason_words import sentence
from farhand.local_site.exchange.requests import Requests
from farhand.local_site.teaching.lesson import LearnedModel

_GIVE_UP_S = 600.0

Settled = Callable[[str, bool], None]
"""Called with the outcome in words, and True for a success."""


@dataclass
class _Transfer:
    """Model being sent, or waiting for its turn."""

    task: str
    learned: LearnedModel
    ask_first: bool
    settled: list[Settled]
    began_s: float = 0.0
    moved: bool = False  # a part of the content was sent
    only_asks: bool = False  # the robot is only asked; nothing is sent

    def notify(self, text: str, good: bool) -> None:
        for settled in self.settled:
            settled(text, good)


class ModelSender:
    """Sender of each task's newest model until it is confirmed, one at a time.

    Used by the console's thread alone.

    Args:
        inquiries: Requests to the robot.
        now_s: The console's clock.
        session: Session of this site.
        rate_bps: Capacity of the link [bit/s], 0 for more than enough; it sets the size of the parts.
    """

    def __init__(self, inquiries: Requests, now_s: Callable[[], float], session: str, rate_bps: float = 0.0):
        self._inquiries, self._now_s, self._part_bytes = inquiries, now_s, part_bytes(rate_bps)
        self._session = session
        self._queue: list[_Transfer] = []  # the first one is being sent
        self._newest: dict[str, str] = {}
        self._confirmed: dict[str, LearnedModel] = {}
        self._had: set[str] = set()  # confirmed earlier; a restarted robot may have lost it

    def sending_sha256(self, task: str) -> str:
        """Return the hash of the task's model that is being sent, or waits for another one's end; empty for none."""
        sent = (each.learned.sha256 for each in self._queue if each.task == task and not each.only_asks)
        return next(sent, "")

    def asking(self, task: str) -> bool:
        """Return whether the robot is being asked if it has a task's model."""
        return any(each.task == task and each.only_asks for each in self._queue)

    def newest_sha256(self, task: str) -> str:
        """Return the hash of the task's model sent last, confirmed or not; empty before the first."""
        return self._newest.get(task, "")

    def confirmed_sha256(self, task: str) -> str:
        """Return the hash of the task's model that the robot confirmed last; empty without one."""
        confirmed = self.confirmed(task)
        return confirmed.sha256 if confirmed is not None else ""

    def confirmed(self, task: str) -> LearnedModel | None:
        """Return the task's model that the robot confirmed last; None without one."""
        return self._confirmed.get(task)

    def forget_confirmed(self) -> None:
        """Forget all confirmations: the robot restarted and may have lost its models."""
        self._confirmed.clear()

    def send(self, task: str, learned: LearnedModel, settled: Settled, ask_first: bool = False) -> None:
        """Send a model in the background, also through outages; it replaces an older one of its task.

        The robot is asked first whether it has the model already, if that is possible or would save much.

        Args:
            task: Name of the model's task.
            learned: The model.
            settled: Called once, with the outcome.
            ask_first: True to ask in any case.
        """
        ask_first = ask_first or learned.sha256 in self._had or len(learned.content) > self._part_bytes
        self._enqueue(_Transfer(task, learned, ask_first, [settled]))

    def ask_whether_it_has(self, task: str, learned: LearnedModel) -> None:
        """Ask the robot whether it has a model, and send nothing: it may have it from before this site's start."""
        if not any(each.task == task for each in self._queue):
            self._enqueue(_Transfer(task, learned, True, [], only_asks=True))

    def _enqueue(self, transfer: _Transfer) -> None:
        task, learned = transfer.task, transfer.learned
        place = next((k for k, other in enumerate(self._queue) if other.task == task), None)
        if place is None:
            self._queue.append(transfer)
        elif (older := self._queue[place]).learned.sha256 == learned.sha256 and not older.only_asks:
            older.settled += transfer.settled
            return
        else:
            self._queue[place] = transfer
            older.notify("a newer one is sent in its place", True)
        if not transfer.only_asks:
            self._newest[task] = learned.sha256
        if self._queue[0] is transfer:
            self._begin(transfer)

    def _begin(self, transfer: _Transfer) -> None:
        transfer.began_s = self._now_s()
        self._send_part(transfer, 0, 0 if transfer.ask_first else self._part_bytes)

    def _send_part(self, transfer: _Transfer, offset: int, n_bytes: int) -> None:
        learned, size = transfer.learned, len(transfer.learned.content)
        transfer.moved |= n_bytes > 0
        part = ModelTransfer(
            session=self._session,
            task=transfer.task,
            sha256=learned.sha256,
            version=learned.version,
            parent_sha256=learned.parent_sha256,
            size=size if size > n_bytes else 0,
            offset=offset,
            content=learned.content[offset : offset + n_bytes],
        )
        answered, wanted = partial(self._on_reply, transfer), partial(self._on_its_way, transfer)
        self._inquiries.ask(keys.MODEL, part, ModelReply, _GIVE_UP_S, answered, wanted)

    def _on_its_way(self, transfer: _Transfer) -> bool:
        return bool(self._queue) and self._queue[0] is transfer

    def _on_reply(self, transfer: _Transfer, reply: ModelReply | None, _took_s: float) -> None:
        if not self._on_its_way(transfer):
            return  # a newer one is being sent, or has arrived
        sha256 = transfer.learned.sha256
        lacks_it = reply is not None and reply.accepted and not reply.complete and reply.sha256 == sha256
        if reply is not None and lacks_it and not transfer.only_asks:
            # Also after a restart of the robot, from the beginning.
            self._send_part(transfer, reply.received, self._part_bytes)
            return
        self._queue.pop(0)
        if lacks_it:
            pass  # the robot was only asked; the operator has to send it
        elif reply is None:
            transfer.notify("NOT DELIVERED: the robot did not confirm it", False)
        elif not reply.accepted or reply.sha256 != sha256:
            transfer.notify(
                f"refused: {sentence(reply.reason) or 'the robot confirmed another model'}", False
            )
        else:
            self._confirmed[transfer.task] = transfer.learned
            self._newest[transfer.task] = sha256
            self._had.add(sha256)
            took_s = self._now_s() - transfer.began_s
            there = f"confirmed after {took_s:.2f} s" if transfer.moved else "the robot has it already"
            transfer.notify(there, True)
        if self._queue:
            self._begin(self._queue[0])
