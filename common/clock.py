"""Clocks: of one boot, counting suspends; of a loop at a fixed rate; and a virtual one that the caller advances.

The two sites share no clock. A stamp is only ever compared with the clock that made it.
"""

from __future__ import annotations

import heapq
import secrets
import threading
import time
from collections.abc import Callable
from itertools import count
from typing import Annotated

from msgspec import Meta

LONGEST_WAIT_S = 1e8
"""Longest wait, three years [s]; the system's own waits end at 300 years."""

Wait = Annotated[float, Meta(ge=1e-3, le=LONGEST_WAIT_S)]
"""Time that a process can wait for [s]."""

_BOOTTIME = getattr(
    time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC
)  # only Linux has a clock that counts suspends
_LEAST_SUSPEND_S = 0.1
"""Least time that counts as a suspend; shorter ones are included in all ages anyway [s]."""


def elapsed_ns() -> int:
    """Return the time of a clock that never goes back and continues while the computer is suspended [ns]."""
    return time.clock_gettime_ns(_BOOTTIME)


def elapsed_s() -> float:
    """Return `elapsed_ns` in seconds; every age is measured with it [s]."""
    return elapsed_ns() * 1e-9


class SuspendWatch:
    """Detector of suspends, by a clock that continues in a suspend and one that stands still.

    Args:
        awake_ns: Clock that stands still in a suspend [ns].
        elapsed_ns: Clock that runs in a suspend [ns].
    """

    def __init__(
        self, awake_ns: Callable[[], int] = time.monotonic_ns, elapsed_ns: Callable[[], int] = elapsed_ns
    ):
        self._awake_ns, self._elapsed_ns = awake_ns, elapsed_ns
        _, self._most_ns = self._apart_ns()

    def suspended_s(self) -> float:
        """Return the duration of a suspend since the last call that reported one [s]; 0.0 for none."""
        least_ns, most_ns = self._apart_ns()
        suspended_s = (least_ns - self._most_ns) * 1e-9
        if suspended_s < _LEAST_SUSPEND_S:
            self._most_ns = min(self._most_ns, most_ns)
            return 0.0
        self._most_ns = most_ns
        return suspended_s

    def _apart_ns(self) -> tuple[int, int]:
        """Return bounds of the clocks' difference: the process may be delayed between two readings."""
        before_ns = self._awake_ns()
        elapsed_ns = self._elapsed_ns()
        return elapsed_ns - self._awake_ns(), elapsed_ns - before_ns


class BootClock:
    """Clock of one process life. It counts a suspend of the computer, so that ages stay true.

    Args:
        boot: Name of this boot; random when not given (recordings and virtual time give one).
        now_ns: Source of time [ns].
    """

    def __init__(self, boot: str | None = None, now_ns: Callable[[], int] = elapsed_ns):
        self.boot = boot or secrets.token_hex(4)
        self.now_ns = now_ns

    def now_s(self) -> float:
        """Return seconds on this clock; its zero is arbitrary."""
        return self.now_ns() * 1e-9


class Rate:
    """Pacer of a loop at a fixed rate without drift; it counts missed ticks.

    Args:
        period_s: Time from one tick to the next [s].
        stop: Event that ends the loop, and the wait at once.
    """

    def __init__(self, period_s: float, stop: threading.Event):
        self._period_s = period_s
        self._stop = stop
        self._due_s = time.monotonic()
        self.overruns = 0
        self.late_s = 0.0
        """Lateness of the present tick [s]."""

    def wait(self) -> bool:
        """Wait for the next tick. Return False if the loop is to end."""
        self._due_s += self._period_s
        late_s = time.monotonic() - self._due_s
        if late_s > self._period_s:
            # A missed tick is not made up for: two in a row would be a jump in time.
            self.overruns += 1
            self._due_s += late_s
        running = not self._stop.wait(max(0.0, self._due_s - time.monotonic()))
        self.late_s = max(late_s, time.monotonic() - self._due_s, 0.0)
        return running


Job = Callable[[], None]


class VirtualTime:
    """Virtual clock with a schedule of jobs; it advances only in `run_until`, which runs the due jobs in order.

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
