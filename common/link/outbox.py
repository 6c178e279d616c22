"""Sending thread, so that the control loop never waits for the transport."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from farhand.common.link.send_queue import SendQueue

Send = Callable[[], None]

HELD_UP_S = 0.08
"""Duration from which a send was delayed by somebody [s]."""


class Outbox:
    """Sender with a thread of its own, in the order and within the budgets of `SendQueue`.

    Args:
        name: Part of the thread's name.
        log: Logger of failed sends.
        held_up: Called after a send that took long.
    """

    def __init__(self, name: str, log: logging.Logger, held_up: Callable[[], None] = lambda: None):
        self._held_up = held_up
        self._queue: SendQueue[Send] = SendQueue()
        self._changed = threading.Condition()
        self._closed = False
        self._log = log
        self._thread = threading.Thread(target=self._run, name=f"send {name}", daemon=True)
        self._thread.start()

    def submit(self, send: Send, newest_only: str | None = None, n_bytes: int = 0) -> None:
        """Have `send` called soon. Never blocks. The arguments are those of `SendQueue.put`."""
        with self._changed:
            if not self._queue.put(send, newest_only, n_bytes):
                self._log.warning("the transport is blocked: the oldest waiting message was dropped")
            self._changed.notify()

    def limit(self, newest_only: str, bytes_per_s: float) -> None:
        """Give a name its byte budget [B/s]; zero or less lifts it."""
        with self._changed:
            self._queue.limit(newest_only, bytes_per_s)
            self._changed.notify()

    def close(self) -> None:
        """End the thread; waiting messages are dropped."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while (send := self._next()) is not None:
            began_s = time.monotonic()
            try:
                send()
                if time.monotonic() - began_s >= HELD_UP_S:
                    self._held_up()
            except Exception as error:  # a closing session raises here; the sender must outlive it
                self._log.warning("a message was not sent: %s", error)

    def _next(self) -> Send | None:
        """Return the next message that may go, or None when the outbox was closed."""
        with self._changed:
            while not self._closed:
                now_s = time.monotonic()
                if (send := self._queue.take(now_s)) is not None:
                    return send
                self._changed.wait(self._queue.ready_in_s(now_s))
            return None
