"""Bounded hand-over of messages between threads; the oldest are dropped for the newest."""

from __future__ import annotations

import threading
from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class Mailbox(Generic[T]):
    """Bounded queue that never blocks its writer.

    Args:
        keep: Largest number of waiting items; with one, the reader sees the newest only.
    """

    def __init__(self, keep: int = 1):
        self._items: deque[T] = deque(maxlen=keep)
        self._arrived = threading.Event()

    def put(self, item: T) -> None:
        """Add an item; drop the oldest one when the mailbox is full."""
        self._items.append(item)
        self._arrived.set()

    def __len__(self) -> int:
        return len(self._items)

    def take_all(self, most: int | None = None) -> list[T]:
        """Return everything that waits, or at most `most` items, oldest first. Never blocks."""
        self._arrived.clear()
        items: list[T] = []
        while self._items and (most is None or len(items) < most):
            items.append(self._items.popleft())
        return items

    def wait(self, timeout_s: float) -> bool:
        """Wait until an item is there. Return False on a time-out."""
        return self._arrived.wait(timeout_s)
