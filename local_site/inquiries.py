"""Questions to the robot that wait for an answer, each in its turn, off the console's thread."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from common.codec import decode, encode
from common.errors import InvalidMessage
from common.keys import Channel
from common.link import Link
from common.log import loop_logger
from common.messages import Message

_log = loop_logger(__name__)

M = TypeVar("M", bound=Message)

_RETRY_S = 0.3


class Inquiries:
    """Asks, and asks again with the same content until an answer comes or it gives up.

    Args:
        link: To the robot.
        ask_timeout_s: Patience for one asking [s]; must exceed the round trip.
    """

    def __init__(self, link: Link, ask_timeout_s: float = 15.0):
        self._link = link
        self._ask_timeout_s = ask_timeout_s
        self._workers = ThreadPoolExecutor(max_workers=32, thread_name_prefix="inquiry")
        self._closed = threading.Event()

    def ask(
        self,
        channel: Channel,
        question: Message,
        kind: type[M],
        give_up_s: float,
        answered: Callable[[M | None, float], None],
        wanted: Callable[[], bool] = lambda: True,
    ) -> None:
        """Put a question; returns at once.

        Args:
            channel: Where it is served.
            question: What to ask. The robot must tolerate hearing it twice.
            kind: Type of the answer.
            give_up_s: How long to try [s]; zero asks once.
            answered: Called from a worker with the answer, or None, and the time that the asking which
                was answered took [s].
            wanted: Whether the answer still matters; it is not asked again when not.
        """
        if not self._closed.is_set():
            self._workers.submit(self._ask, channel, encode(question), kind, give_up_s, answered, wanted)

    def ask_and_wait(self, channel: Channel, question: Message, kind: type[M], timeout_s: float) -> M | None:
        """Ask once and wait for the answer. None when none came in time."""
        answers: queue.SimpleQueue[M | None] = queue.SimpleQueue()
        self.ask(channel, question, kind, 0.0, lambda answer, _took_s: answers.put(answer))
        try:
            return answers.get(timeout=timeout_s)
        except queue.Empty:
            return None

    def close(self) -> None:
        """End all asking."""
        self._closed.set()
        self._workers.shutdown(wait=False, cancel_futures=True)

    def _ask(
        self,
        channel: Channel,
        data: bytes,
        kind: type[M],
        give_up_s: float,
        answered: Callable[[M | None, float], None],
        wanted: Callable[[], bool],
    ) -> None:
        deadline_s = time.monotonic() + give_up_s
        while not self._closed.is_set():
            asked_s = time.monotonic()
            reply = self._link.ask(channel, data, self._ask_timeout_s)
            if reply is not None:
                try:
                    answer = decode(reply, kind)
                except InvalidMessage as error:
                    _log.warning("an answer was not understood: %s", error)
                else:
                    answered(answer, time.monotonic() - asked_s)
                    return
            if time.monotonic() >= deadline_s or not wanted():
                break
            self._closed.wait(_RETRY_S)
        if not self._closed.is_set():
            answered(None, 0.0)
