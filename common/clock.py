"""Time: a monotonic clock that names its boot, and a fixed-rate loop.

The two sites share no clock. A stamp is only ever compared with the clock that made it.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable


class BootClock:
    """The monotonic clock of one process life.

    Args:
        boot: Name of this boot; a random one unless given (recordings, virtual time).
        monotonic_ns: The source of time [ns].
    """

    def __init__(self, boot: str | None = None, monotonic_ns: Callable[[], int] = time.monotonic_ns):
        self.boot = boot or secrets.token_hex(4)
        self.now_ns = monotonic_ns

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
