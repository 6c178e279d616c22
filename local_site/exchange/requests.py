"""Requests to the robot, retried with the same content until an answer comes or the time is over."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from farhand.common.errors import InvalidMessage
from farhand.common.link.interface import Link
from farhand.common.log import loop_logger
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import Message

_log = loop_logger(__name__)

M = TypeVar("M", bound=Message)
Do = Callable[[Callable[[], None]], None]

_RETRY_S = 0.3
_OVERDUE_S = 1.0
"""Time beyond the link's own time-out after which an attempt counts as lost: a closed link never answers [s]."""


@dataclass
class _Inquiry:
    """Request in progress.

    Args:
        channel: Channel of the request.
        data: Encoded question.
        kind: Type of the answer.
        give_up_s: Time of the last retry, on the owner's clock [s].
        answered: Called with the answer, or None, and the duration of the answered attempt [s].
        wanted: Returns False once the answer no longer matters.
        asked_s: Time of the newest attempt [s].
        waiting: True while the newest attempt may still be answered.
    """

    channel: Channel
    data: bytes
    kind: type[Message]
    give_up_s: float
    answered: Callable[[Any, float], None]
    wanted: Callable[[], bool]
    asked_s: float = 0.0
    waiting: bool = True


class Requests:
    """Requests to the robot. Used by its owner's thread alone, which calls `tick` often.

    Args:
        link: Link to the robot.
        do: Runs a job in the owner's thread.
        now_s: The owner's clock [s].
        ask_timeout_s: Time-out of one attempt [s]; must exceed the round trip.
    """

    def __init__(self, link: Link, do: Do, now_s: Callable[[], float], ask_timeout_s: float = 15.0):
        self._link, self._do, self.now_s = link, do, now_s
        self._ask_timeout_s = ask_timeout_s
        self._open: list[_Inquiry] = []

    def ask(
        self,
        channel: Channel,
        question: Message,
        kind: type[M],
        give_up_s: float,
        answered: Callable[[M | None, float], None],
        wanted: Callable[[], bool] = lambda: True,
    ) -> None:
        """Ask a question; returns at once.

        Args:
            channel: Channel of the request.
            question: The question; it may arrive twice.
            kind: Type of the answer.
            give_up_s: Time to retry [s]; zero asks once.
            answered: Called on the owner's thread with the answer, or None, and the duration of the
                answered attempt [s].
            wanted: Returns False once the answer no longer matters; the question is then not repeated.
        """
        give_up_s += self.now_s()
        inquiry = _Inquiry(channel, encode(question), kind, give_up_s, answered, wanted)
        self._open.append(inquiry)
        self._put(inquiry)

    def tick(self, now_s: float) -> None:
        """Retry the questions that are due."""
        for inquiry in list(self._open):
            since_s = now_s - inquiry.asked_s
            if (inquiry.waiting and since_s > self._ask_timeout_s + _OVERDUE_S) or (
                not inquiry.waiting and not inquiry.wanted()
            ):
                self._unanswered(inquiry)
            elif not inquiry.waiting and since_s >= _RETRY_S:
                self._put(inquiry)

    def close(self) -> None:
        """End all requests without an answer."""
        self._open.clear()

    def _put(self, inquiry: _Inquiry) -> None:
        inquiry.asked_s, inquiry.waiting = self.now_s(), True
        on_reply = partial(self._on_reply, inquiry, inquiry.asked_s)
        self._link.ask(
            inquiry.channel, inquiry.data, self._ask_timeout_s, lambda data: self._do(partial(on_reply, data))
        )

    def _on_reply(self, inquiry: _Inquiry, asked_s: float, data: bytes | None) -> None:
        if inquiry not in self._open:
            return  # another attempt was answered
        answer = self._decoded(data, inquiry.kind)
        if answer is not None:
            self._open.remove(inquiry)
            inquiry.answered(answer, self.now_s() - asked_s)
        elif asked_s == inquiry.asked_s:
            self._unanswered(inquiry)

    def _unanswered(self, inquiry: _Inquiry) -> None:
        inquiry.waiting = False
        if self.now_s() >= inquiry.give_up_s or not inquiry.wanted():
            self._open.remove(inquiry)
            inquiry.answered(None, 0.0)

    def _decoded(self, data: bytes | None, kind: type[M]) -> M | None:
        try:
            return None if data is None else decode(data, kind)
        except InvalidMessage as error:
            _log.warning("an answer was not understood: %s", error)
            return None
