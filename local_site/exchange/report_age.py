"""Age of what the robot reported, with the round trip and the missing reports: the link as one site sees it."""

from __future__ import annotations

from collections import OrderedDict, deque
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from farhand.common.wire.messages import Stamp, Telemetry

_LATE_S = 0.5
_LOST_S = 2.0
_OLD_S, _TOO_OLD_S = 1.0, 5.0
"""Excess of the newest report's age over the least age, from which reports count as late, and as lost [s]."""
_AGED_S, _TOO_AGED_S = 5.0, 15.0
"""Absolute ages from which reports count as late, and as lost: the robot refuses answers to such old reports [s]."""
_HEARTBEATS_KEPT = 2048
_HISTORY = 600


class LinkHealth(StrEnum):
    """Arrival of reports."""

    NEVER = "never"
    OK = "ok"
    LATE = "late"
    LOST = "lost"


@dataclass(frozen=True)
class LinkView:
    """State of the link at one moment.

    Args:
        health: Arrival of the reports: ok, late, lost, or never.
        silent_s: Time since the newest report arrived [s].
        round_trip_s: Newest measured round trip [s], None before the first.
        age_s: Estimated age of the newest report: its silence plus half the round trip [s].
        n_received: Reports received.
        n_missed: Reports that were sent but skipped or lost.
    """

    health: LinkHealth
    silent_s: float
    round_trip_s: float | None
    age_s: float | None
    n_received: int
    n_missed: int


class LinkMonitor:
    """Observer of the reports and of the heartbeats that they echo. Times are the caller's own clock [s]."""

    def __init__(self) -> None:
        self._sent_s: OrderedDict[int, float] = OrderedDict()
        self._last_echo = 0
        self._arrived_s: float | None = None
        self._boot, self._seq = "", 0
        self._n_received = self._n_missed = 0
        self._round_trips: deque[float] = deque(maxlen=_HISTORY)
        self._ways_s: deque[float] = deque(maxlen=_HISTORY)
        """Arrival minus stamp of the last reports; includes the unknown difference of the two clocks."""

    def heartbeat_sent(self, seq: int, now_s: float) -> None:
        """Note a sent heartbeat."""
        self._sent_s[seq] = now_s
        if len(self._sent_s) > _HEARTBEATS_KEPT:
            self._sent_s.popitem(last=False)

    def received(self, report: Telemetry, now_s: float) -> bool:
        """Note a received report.

        Returns:
            Whether it is newer than all before; an older one must not be shown.
        """
        if report.stamp.boot == self._boot:
            if report.seq <= self._seq:
                return False
            self._n_missed += report.seq - self._seq - 1
        else:
            self._ways_s.clear()
        self._ways_s.append(now_s - report.stamp.t_ns * 1e-9)
        self._boot, self._seq, self._arrived_s = report.stamp.boot, report.seq, now_s
        self._n_received += 1
        if report.heartbeat_echo != self._last_echo:
            self._last_echo = report.heartbeat_echo
            if (sent_s := self._sent_s.get(report.heartbeat_echo)) is not None:
                self._round_trips.append(now_s - sent_s - report.heartbeat_held_ms * 1e-3)
        return True

    def view(self, now_s: float) -> LinkView:
        """Return the present state of the link."""
        newest = self._round_trips[-1] if self._round_trips else None
        if self._arrived_s is None:
            return LinkView(LinkHealth.NEVER, float("inf"), newest, None, 0, 0)
        silent_s = now_s - self._arrived_s
        excess_s = silent_s + self._ways_s[-1] - min(self._ways_s)
        age_s = None if newest is None else silent_s + 0.5 * newest
        if age_s is not None and excess_s >= _OLD_S:
            # A report that an outage held up is older than its silence and the newest round trip tell; a small
            # excess may be the two clocks' drift.
            age_s = max(age_s, excess_s + 0.5 * min(self._round_trips))
        limits = [
            (silent_s, _LATE_S, _LOST_S),
            (excess_s, _OLD_S, _TOO_OLD_S),
            (age_s or 0.0, _AGED_S, _TOO_AGED_S),
        ]
        health = LinkHealth.OK
        if any(value >= late for value, late, _ in limits):
            health = LinkHealth.LATE
        if any(value >= lost for value, _, lost in limits):
            health = LinkHealth.LOST
        return LinkView(health, silent_s, newest, age_s, self._n_received, self._n_missed)

    def is_silent(self, now_s: float) -> bool:
        """Decide whether the silence is so long that messages may have been missed."""
        return self._arrived_s is None or now_s - self._arrived_s >= _LOST_S

    def late_s(self, stamp: Stamp, now_s: float) -> float:
        """Return the excess of a message's transit time over that of the quickest recent report [s].

        Args:
            stamp: Time of sending on the robot's clock.
            now_s: Present time [s].
        """
        if stamp.boot != self._boot or not self._ways_s:
            return 0.0
        return max(0.0, now_s - stamp.t_ns * 1e-9 - min(self._ways_s))

    def median_round_trip_s(self) -> float | None:
        """Return the median of the last measured round trips [s]."""
        return float(np.median(self._round_trips)) if self._round_trips else None
