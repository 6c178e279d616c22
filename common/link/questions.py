"""Questions and their answers; urgent ones are sent reliably and again as datagrams, and handled once.

The loss of a packet in the reliable stream is detected after one round trip at the earliest. Copies sent shortly
afterwards do not wait for that. The first copy to arrive is handled, and the first answer to arrive is used.
"""

from __future__ import annotations

import secrets
import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable
from typing import Any

import zenoh

from farhand.common.clock import elapsed_s
from farhand.common.link.outbox import Outbox

ID_BYTES = 8
_COPIES_S = (0.0, 0.1, 0.2, 0.5, 0.9, 1.4, 2.0, 3.0, 4.0)
"""Times of the copies after their question, until it is answered [s]."""
_ANSWERS_KEPT = 256

Answered = Callable[[bytes | None], None]
Reply = Callable[[bytes], None]


class Question:
    """Question of this site, settled by its first answer.

    Args:
        answered: Called once, with the answer, or with None if none came.
    """

    def __init__(self, answered: Answered):
        self.id = secrets.token_bytes(ID_BYTES)
        """Id in all copies and answers."""
        self._answered: Answered | None = answered
        self._lock = threading.Lock()

    @property
    def is_open(self) -> bool:
        """True while the question has no answer."""
        return self._answered is not None

    def on_reply(self, reply: zenoh.Reply) -> None:
        """Process a reply of the transport."""
        if reply.ok is not None:
            self.give(reply.ok.payload.to_bytes())

    def on_end(self) -> None:
        """Process the end of the transport's replies."""
        self.give(None)

    def give(self, data: bytes | None) -> None:
        """Settle the question with an answer, or with None if there is none."""
        with self._lock:
            answered, self._answered = self._answered, None
        if answered is not None:
            answered(data)


class Copies:
    """Sender of the copies of this site's open questions, in a thread of its own."""

    def __init__(self) -> None:
        self._open: dict[bytes, tuple[Question, Callable[[], None], float, int]] = {}
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="copies", daemon=True)
        self._thread.start()

    def add(self, question: Question, send: Callable[[], None]) -> None:
        """Send copies of a question until it is answered.

        Args:
            question: The question.
            send: Sends one copy; never blocks.
        """
        with self._changed:
            self._open[question.id] = (question, send, elapsed_s(), 0)
            self._changed.notify()

    def answered(self, question_id: bytes, data: bytes) -> None:
        """Process an answer to one of the copies; late ones are ignored."""
        with self._changed:
            question, *_ = self._open.pop(question_id, (None,))
        if question is not None:
            question.give(data)

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while (due := self._due()) is not None:
            for send in due:
                send()

    def _due(self) -> list[Callable[[], None]] | None:
        """Wait for due copies; return None at the end."""
        with self._changed:
            while not self._closed:
                now_s, due, next_s = elapsed_s(), [], None
                for key, (question, send, began_s, sent) in list(self._open.items()):
                    # The last copy may still be answered; after that, or a suspend, the sender asks a new question.
                    if not question.is_open or now_s - began_s > 2.0 * _COPIES_S[-1]:
                        del self._open[key]
                        continue
                    if sent == len(_COPIES_S):
                        continue
                    if now_s >= began_s + _COPIES_S[sent]:
                        due.append(send)
                        self._open[key], sent = (question, send, began_s, sent + 1), sent + 1
                    if sent < len(_COPIES_S):
                        at_s = began_s + _COPIES_S[sent]
                        next_s = at_s if next_s is None else min(next_s, at_s)
                if due:
                    return due
                self._changed.wait(None if next_s is None else max(0.0, next_s - now_s))
            return None


class Once:
    """Server of a channel with copied questions: the first copy is handled, each copy is answered.

    Args:
        handle: Called once with each question; may drop it, which leaves it unanswered.
    """

    def __init__(self, handle: Callable[[OnceRequest], bool | None]):
        self._handle = handle
        self._lock = threading.Lock()
        self._open: weakref.WeakValueDictionary[bytes, OnceRequest] = weakref.WeakValueDictionary()
        self._answers: OrderedDict[bytes, bytes] = OrderedDict()

    def take(self, question_id: bytes, data: bytes, reply: Reply) -> bool | None:
        """Process a copy; return the handler's result, or None for a copy of a known question.

        Args:
            question_id: Id of the question.
            data: Bytes of the question.
            reply: Sends the answer on the path of this copy; never blocks.
        """
        request = OnceRequest(question_id, data, reply, self._remember)
        with self._lock:
            known = self._open.get(question_id)
            if known is not None and known.also(reply):
                return None
            if (answer := self._answers.get(question_id)) is None:
                self._open[question_id] = request
        if answer is None:
            return self._handle(request)
        reply(answer)
        return None

    def _remember(self, question_id: bytes, answer: bytes) -> None:
        self._answers[question_id] = answer
        if len(self._answers) > _ANSWERS_KEPT:
            self._answers.popitem(last=False)


class OnceRequest:
    """`Request` that is answered on the path of every copy."""

    def __init__(
        self, question_id: bytes, data: bytes, reply: Reply, remember: Callable[[bytes, bytes], None]
    ):
        self.data = data
        self._id, self._remember = question_id, remember
        self._lock = threading.Lock()
        self._replies: list[Reply] | None = [reply]

    def also(self, reply: Reply) -> bool:
        """Add the path of another copy; return False if the request was answered already."""
        with self._lock:
            if self._replies is None:
                return False
            self._replies.append(reply)
            return True

    def answer(self, data: bytes) -> None:
        """Answer the request, from any thread, without blocking."""
        with self._lock:
            replies, self._replies = self._replies, None
            self._remember(self._id, data)
        for reply in replies or ():
            reply(data)


class ZenohRequest:
    """`Request` that is answered by the transport's reply.

    Args:
        query: The question.
        data: Bytes of the question.
        outbox: Sends the answer.
    """

    def __init__(self, query: zenoh.Query, data: bytes, outbox: Outbox):
        self._query, self._outbox = query, outbox
        self.data = data

    def answer(self, data: bytes) -> None:
        """Answer it, from any thread, without blocking."""
        self._outbox.submit(lambda: reply_to(self._query, data))


def reply_to(query: zenoh.Query, data: bytes) -> None:
    """Answer a question now, at the question's priority."""
    with query:
        query.reply(query.key_expr, data, express=True)


def in_reader(take: Callable[[Any], None]) -> Any:
    """Return a handler that is called in the thread that reads the connection."""
    return zenoh.handlers.Callback(take, indirect=False)
