"""Reduction of sending while nothing is heard, so that the link is found open as soon as it is."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

_SMALL_BYTES = 128
_SMALL_PAUSE_S, _LARGE_PAUSE_S = 1 / 3, 5.0
"""Pauses between probes. In half a minute, after which QUIC gives the connection up, they stay within 12 kB, its first window."""
_SILENT_AFTER_S, _NARROW_SILENT_AFTER_S = 0.5, 2.0
_NARROW_BPS = 100_000.0


class SilenceGate:
    """Gate that passes all messages while the other site is heard, and few small ones while it is not.

    Over QUIC, data sent into an outage stays unacknowledged and fills the congestion window. Then only the
    transport's own probes leave, at intervals that double each time: the link would be found open after a
    time as long as the outage was.

    Args:
        rate_bps: Capacity of the link [bit/s]; 0: more than enough. On a narrow link messages are rarer,
            and silence is longer.
        clock: Returns the time, on a clock that does not go back [s].
    """

    def __init__(self, rate_bps: float = 0.0, clock: Callable[[], float] = time.monotonic):
        self._silent_after_s = _NARROW_SILENT_AFTER_S if 0 < rate_bps < _NARROW_BPS else _SILENT_AFTER_S
        self._clock, self._lock = clock, threading.Lock()
        self._heard_s = clock()
        self._probed_s = {True: -_LARGE_PAUSE_S, False: -_LARGE_PAUSE_S}

    def heard(self) -> None:
        """Note that something arrived."""
        self._heard_s = self._clock()

    def lets_out(self, n_bytes: int) -> bool:
        """Decide whether a message that the next one replaces may be sent now.

        Args:
            n_bytes: Size of the message.
        """
        with self._lock:
            now_s = self._clock()
            if now_s - self._heard_s <= self._silent_after_s:
                return True
            small = n_bytes < _SMALL_BYTES
            if now_s - self._probed_s[small] < (_SMALL_PAUSE_S if small else _LARGE_PAUSE_S):
                return False
            self._probed_s[small] = now_s
            return True
