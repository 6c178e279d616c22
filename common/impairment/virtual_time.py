"""Time that passes only when somebody moves it on: what is due is done in order, at once."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from itertools import count

Job = Callable[[], None]


class VirtualTime:
    """A clock and what is to be done when.

    Args:
        start_s: The time at first [s].
    """

    def __init__(self, start_s: float = 0.0):
        self._now_s = start_s
        self._due: list[tuple[float, int, Job]] = []
        self._order = count()

    def now_s(self) -> float:
        """Return the time [s]."""
        return self._now_s

    def now_ns(self) -> int:
        """Return the time [ns], for a `BootClock`."""
        return round(self._now_s * 1e9)

    def call_at(self, time_s: float, job: Job) -> None:
        """Have a job done at a time [s]; at once when that is over. Of two at the same time the earlier call first."""
        heapq.heappush(self._due, (max(time_s, self._now_s), next(self._order), job))

    def call_later(self, delay_s: float, job: Job) -> None:
        """Have a job done after so long [s]."""
        self.call_at(self._now_s + delay_s, job)

    def run_until(self, time_s: float, after_each: Job = lambda: None) -> None:
        """Let time pass.

        Args:
            time_s: Until when [s].
            after_each: Done after each job.
        """
        while self._due and self._due[0][0] <= time_s:
            self._now_s, _, job = heapq.heappop(self._due)
            job()
            after_each()
        self._now_s = max(self._now_s, time_s)
