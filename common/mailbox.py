"""Hand-over of messages between threads: bounded, the oldest give way to the newest."""

from __future__ import annotations

import threading
from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class Mailbox(Generic[T]):
    """A bounded queue that never blocks its writer.

    Args:
        keep: How many items wait; with one, the reader sees the newest only.
    """

    def __init__(self, keep: int = 1):
        self._items: deque[T] = deque(maxlen=keep)
        self._arrived = threading.Event()

    def put(self, item: T) -> None:
        """Add an item; when the box is full the oldest one is dropped."""
        self._items.append(item)
        self._arrived.set()

    def __len__(self) -> int:
        return len(self._items)

    def take_all(self, most: int | None = None) -> list[T]:
        """Everything that waits, or so many at most, oldest first. Never blocks."""
        self._arrived.clear()
        items: list[T] = []
        while self._items and (most is None or len(items) < most):
            items.append(self._items.popleft())
        return items

    def wait(self, timeout_s: float) -> bool:
        """Wait until something is there. False when nothing came in time."""
        return self._arrived.wait(timeout_s)
