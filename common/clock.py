"""Time: a clock that names its boot and runs on while the computer is suspended, and a fixed-rate loop.

The two sites share no clock. A stamp is only ever compared with the clock that made it.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable
from typing import Annotated

from msgspec import Meta

LONGEST_WAIT_S = 1e8
"""Longest time that is waited for, three years [s]: the waits of the system end at 300."""

Wait = Annotated[float, Meta(ge=1e-3, le=LONGEST_WAIT_S)]
"""A time that a process can wait for [s]."""

_BOOTTIME = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)  # only Linux has one that counts a suspend
_LEAST_SUSPEND_S = 0.1
"""Nothing shorter is a suspend: it is counted in the ages all the same [s]."""


def elapsed_ns() -> int:
    """Return the time of a clock that never goes back and counts while the computer is suspended [ns]."""
    return time.clock_gettime_ns(_BOOTTIME)


def elapsed_s() -> float:
    """Return the same in seconds: what every age is measured with [s]."""
    return elapsed_ns() * 1e-9


class SuspendWatch:
    """Notices that the computer was suspended: one clock ran on meanwhile, the other stood still.

    Args:
        awake_ns: A clock that stands still in a suspend [ns].
        elapsed_ns: One that runs on [ns].
    """

    def __init__(
        self, awake_ns: Callable[[], int] = time.monotonic_ns, elapsed_ns: Callable[[], int] = elapsed_ns
    ):
        self._awake_ns, self._elapsed_ns = awake_ns, elapsed_ns
        _, self._most_ns = self._apart_ns()

    def suspended_s(self) -> float:
        """Return for how long it was suspended since the last call that noticed it [s]; 0.0 for not at all."""
        least_ns, most_ns = self._apart_ns()
        suspended_s = (least_ns - self._most_ns) * 1e-9
        if suspended_s < _LEAST_SUSPEND_S:
            self._most_ns = min(self._most_ns, most_ns)
            return 0.0
        self._most_ns = most_ns
        return suspended_s

    def _apart_ns(self) -> tuple[int, int]:
        """What the clocks are apart, at least and at most: a process may be held up between two readings."""
        before_ns = self._awake_ns()
        elapsed_ns = self._elapsed_ns()
        return elapsed_ns - self._awake_ns(), elapsed_ns - before_ns


class BootClock:
    """The clock of one process life. It counts a suspend of the computer, for ages to be true after it.

    Args:
        boot: Name of this boot; a random one unless given (recordings, virtual time).
        now_ns: The source of time [ns].
    """

    def __init__(self, boot: str | None = None, now_ns: Callable[[], int] = elapsed_ns):
        self.boot = boot or secrets.token_hex(4)
        self.now_ns = now_ns

    def now_s(self) -> float:
        """Seconds on this clock; the zero means nothing."""
        return self.now_ns() * 1e-9


class Rate:
    """Paces a loop at a fixed rate without drift and counts what it missed.

    Args:
        period_s: Time from one tick to the next [s].
        stop: Set by anybody to end the loop; the wait ends at once.
    """

    def __init__(self, period_s: float, stop: threading.Event):
        self._period_s = period_s
        self._stop = stop
        self._due_s = time.monotonic()
        self.overruns = 0
        self.late_s = 0.0
        """How late the present tick began [s]."""

    def wait(self) -> bool:
        """Wait for the next tick. False when the loop was asked to end."""
        self._due_s += self._period_s
        late_s = time.monotonic() - self._due_s
        if late_s > self._period_s:
            # A tick that was missed is not made up for: two in a row would be a jump in time.
            self.overruns += 1
            self._due_s += late_s
        running = not self._stop.wait(max(0.0, self._due_s - time.monotonic()))
        self.late_s = max(late_s, time.monotonic() - self._due_s, 0.0)
        return running
