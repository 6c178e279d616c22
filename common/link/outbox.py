"""Sending thread, so that the control loop never waits for the transport.

Its queue keeps the order, only the newest message where that suffices, and byte budgets.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")

_MOST_WAITING = 1024
"""Largest number of messages that wait for a blocked transport; those that must arrive are repeated by their senders."""


class SendQueue(Generic[T]):
    """Queue of messages for one sender.

    Of messages with the same `newest_only` name only the newest waits; a message with a byte budget is sent
    no faster than that budget allows, and later ones replace it, so none are queued. Times are on any clock
    that does not go back [s].
    """

    def __init__(self) -> None:
        self._waiting: OrderedDict[object, tuple[T, str | None, int]] = OrderedDict()
        self._budgets: dict[str, float] = {}
        self._not_before_s: dict[str, float] = {}

    def put(self, item: T, newest_only: str | None = None, n_bytes: int = 0) -> bool:
        """Add an item.

        Args:
            item: The message.
            newest_only: Name under which only the newest waits, or None for every message.
            n_bytes: Size, for the budget of that name.

        Returns:
            Whether there was room; if not, the oldest was dropped for it.
        """
        key = newest_only if newest_only is not None else object()
        self._waiting[key] = (item, newest_only, n_bytes)
        if len(self._waiting) > _MOST_WAITING:
            self._waiting.popitem(last=False)
            return False
        return True

    def limit(self, newest_only: str, bytes_per_s: float) -> None:
        """Set the byte budget of a name [B/s]; zero or less removes it."""
        self._budgets[newest_only] = bytes_per_s
        self._not_before_s.pop(newest_only, None)

    def clear(self) -> None:
        """Drop the waiting messages; budgets stay."""
        self._waiting.clear()

    def take(self, now_s: float) -> T | None:
        """Return the oldest item that may be sent now, or None."""
        for key, (item, name, n_bytes) in self._waiting.items():
            if self._remaining_s(name, now_s) <= 0.0:
                del self._waiting[key]
                if name and (budget := self._budgets.get(name, 0.0)) > 0.0:
                    self._not_before_s[name] = now_s + n_bytes / budget
                return item
        return None

    def ready_in_s(self, now_s: float) -> float | None:
        """Return the time until an item may be sent [s]; None if nothing waits."""
        waits_s = (self._remaining_s(name, now_s) for _, name, _ in self._waiting.values())
        return min(waits_s, default=None)

    def _remaining_s(self, name: str | None, now_s: float) -> float:
        return max(0.0, self._not_before_s.get(name, now_s) - now_s) if name else 0.0


Send = Callable[[], None]

HELD_UP_S = 0.08
"""Duration of a send above which a listener has delayed it [s]."""


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
