"""Virtual time, which passes only when somebody advances it: due jobs are done in order, at once."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from itertools import count

Job = Callable[[], None]


class VirtualTime:
    """Clock with a schedule of jobs.

    Args:
        start_s: First time [s].
    """

    def __init__(self, start_s: float = 0.0):
        self._now_s = start_s
        self._due: list[tuple[float, int, Job]] = []
        self._order = count()

    def now_s(self) -> float:
        """Return the present time [s]."""
        return self._now_s

    def now_ns(self) -> int:
        """Return the present time [ns], for a `BootClock`."""
        return round(self._now_s * 1e9)

    def call_at(self, time_s: float, job: Job) -> None:
        """Schedule a job at a time [s], or at once if that has passed.

        Jobs of the same time run in the order of their calls.
        """
        heapq.heappush(self._due, (max(time_s, self._now_s), next(self._order), job))

    def call_later(self, delay_s: float, job: Job) -> None:
        """Schedule a job after a delay [s]."""
        self.call_at(self._now_s + delay_s, job)

    def run_until(self, time_s: float, after_each: Job = lambda: None) -> None:
        """Advance the time.

        Args:
            time_s: Time to advance to [s].
            after_each: Called after each job.
        """
        while self._due and self._due[0][0] <= time_s:
            self._now_s, _, job = heapq.heappop(self._due)
            job()
            after_each()
        self._now_s = max(self._now_s, time_s)
