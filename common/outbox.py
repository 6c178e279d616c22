"""One thread that sends, so that the control loop never waits for the transport."""

from __future__ import annotations

import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable

Send = Callable[[], None]

_MOST_WAITING = 1024
"""Acknowledged messages that may wait for a blocked transport; their senders resend them anyway."""


class Outbox:
    """Sends what it is given, in order, from its own thread.

    Of a message with a `newest_only` name only the newest waits; one with a byte budget is sent no
    faster than that budget allows, and what comes in between is replaced, never queued.

    Args:
        name: For the thread's name.
        log: Where a failed send is reported.
    """

    def __init__(self, name: str, log: logging.Logger):
        self._waiting: OrderedDict[object, tuple[Send, str | None, int]] = OrderedDict()
        self._budgets: dict[str, float] = {}
        self._not_before_s: dict[str, float] = {}
        self._changed = threading.Condition()
        self._closed = False
        self._log = log
        self._thread = threading.Thread(target=self._run, name=f"send {name}", daemon=True)
        self._thread.start()

    def submit(self, send: Send, newest_only: str | None = None, n_bytes: int = 0) -> None:
        """Have `send` called soon. Never blocks.

        Args:
            send: The transport's call.
            newest_only: Name under which only the newest waits, or None for every message.
            n_bytes: Size, for the budget of that name.
        """
        with self._changed:
            key = newest_only if newest_only is not None else object()
            self._waiting[key] = (send, newest_only, n_bytes)
            if len(self._waiting) > _MOST_WAITING:
                self._waiting.popitem(last=False)
                self._log.warning("the transport is blocked: the oldest waiting message was dropped")
            self._changed.notify()

    def limit(self, newest_only: str, bytes_per_s: float) -> None:
        """Give a name its byte budget [B/s]; zero or less lifts it."""
        with self._changed:
            self._budgets[newest_only] = bytes_per_s
            self._not_before_s.pop(newest_only, None)
            self._changed.notify()

    def close(self) -> None:
        """End the thread; what still waits is not sent."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while (send := self._next()) is not None:
            try:
                send()
            except Exception as error:  # a closing session raises here; the sender must outlive it
                self._log.warning("a message was not sent: %s", error)

    def _next(self) -> Send | None:
        """The next message that may go, or None when the outbox was closed."""
        with self._changed:
            while not self._closed:
                now_s = time.monotonic()
                wait_s: float | None = None
                for key, (send, name, n_bytes) in self._waiting.items():
                    remaining_s = self._not_before_s.get(name, now_s) - now_s if name else 0.0
                    if remaining_s <= 0.0:
                        del self._waiting[key]
                        if name and (budget := self._budgets.get(name, 0.0)) > 0.0:
                            self._not_before_s[name] = now_s + n_bytes / budget
                        return send
                    wait_s = min(remaining_s, wait_s) if wait_s is not None else remaining_s
                self._changed.wait(wait_s)
            return None
