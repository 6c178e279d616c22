"""Queue of messages to send: in order, newest-only if that suffices, within byte budgets. It has no clock."""

from __future__ import annotations

from collections import OrderedDict
from typing import Generic, TypeVar

T = TypeVar("T")

_MOST_WAITING = 1024
"""Messages that may wait for a blocked transport; those that must arrive are sent again anyway."""


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
        """Give a name its byte budget [B/s]; zero or less lifts it."""
        self._budgets[newest_only] = bytes_per_s
        self._not_before_s.pop(newest_only, None)

    def clear(self) -> None:
        """Drop what waits; budgets stay."""
        self._waiting.clear()

    def take(self, now_s: float) -> T | None:
        """Return the oldest item that may go now, or None."""
        for key, (item, name, n_bytes) in self._waiting.items():
            if self._remaining_s(name, now_s) <= 0.0:
                del self._waiting[key]
                if name and (budget := self._budgets.get(name, 0.0)) > 0.0:
                    self._not_before_s[name] = now_s + n_bytes / budget
                return item
        return None

    def ready_in_s(self, now_s: float) -> float | None:
        """Return the time until an item may go [s]; None when nothing waits."""
        waits_s = (self._remaining_s(name, now_s) for _, name, _ in self._waiting.values())
        return min(waits_s, default=None)

    def _remaining_s(self, name: str | None, now_s: float) -> float:
        return max(0.0, self._not_before_s.get(name, now_s) - now_s) if name else 0.0
