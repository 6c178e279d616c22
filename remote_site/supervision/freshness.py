"""Freshness of a message, decided on the robot's clock alone, from the stamp that the message echoes.

A message carries the newest stamp of the robot that its sender had seen and shown. The age of that stamp is
one round trip when all is well, and grows by whatever delayed the message.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from farhand.common.clock import BootClock
from farhand.common.wire.messages import Stamp
from farhand.common.wire.reasons import Code, Reason, because

_WINDOW = 10
_RISING = 2
"""Consecutive late renewals that show a risen delay, not one delayed message."""
_LEAST_GAP_S = 0.3
"""Renewals come at 1 Hz; closer together they come from a backlog."""
_TTL_MIN_S, _TTL_MAX_S = 0.25, 1.0
"""Least and largest excess of a message's age over the usual age that is accepted [s]."""


@dataclass(frozen=True)
class Verdict:
    """Verdict on a message.

    Args:
        reason: Reason of its refusal; None if it is accepted.
        age_s: Age of its echo [s]; None if it could not be measured.
    """

    reason: Reason | None
    age_s: float | None
    delay_changed: bool = False
    """True if a longer delay is usual from now on."""


class Freshness:
    """Judge of ages against those usual on this link.

    Args:
        clock: The robot's clock.
        max_age_s: Largest age that is ever accepted [s].
        telemetry_period_s: Time between two reports: the echo may be that much older [s].
    """

    def __init__(self, clock: BootClock, max_age_s: float, telemetry_period_s: float):
        self._clock = clock
        self._max_age_s = max_age_s
        self.telemetry_period_s = telemetry_period_s
        """Time between two reports at present [s]."""
        self._accepted: deque[float] = deque(maxlen=_WINDOW)
        self._late: deque[float] = deque(maxlen=_WINDOW)
        self._last_renewal_s = -np.inf
        self._last_echo_ns = -1

    @property
    def two_reports_s(self) -> float:
        """Possible age of an echo beyond the usual one, with one report lost [s]: much, where reports are rare."""
        return 2.0 * self.telemetry_period_s + 0.1

    @property
    def _command_ttl_max_s(self) -> float:
        return max(_TTL_MAX_S, self.two_reports_s)

    @property
    def reference_s(self) -> float | None:
        """Smallest age of the last accepted renewals [s]; None before the first."""
        return min(self._accepted) if self._accepted else None

    @property
    def rising(self) -> bool:
        """True if the last renewals came in order, one by one, and all of them too late."""
        return len(self._late) >= _RISING

    def forget(self) -> None:
        """Forget the usual age, because another site is heard from now on."""
        self._accepted.clear()
        self._late.clear()
        self._last_echo_ns, self._last_renewal_s = -1, -np.inf

    def judge(self, echo: Stamp | None, ttl_max_s: float | None = None, what: str = "command") -> Verdict:
        """Judge whether a message with this echo is fresh.

        Args:
            echo: The robot's stamp in the message.
            ttl_max_s: Upper bound of the excess over the reference [s]; None for that of a command.
            what: Kind of the message, for the reason.
        """
        if echo is None:
            return Verdict(because(Code.NO_ECHO, what=what), None)
        if echo.boot != self._clock.boot:
            return Verdict(because(Code.OTHER_BOOT, what=what), None)
        age_s = (self._clock.now_ns() - echo.t_ns) * 1e-9
        if age_s < 0.0:
            return Verdict(because(Code.NEVER_SENT, age_s=age_s, what=what), age_s)
        limit_s = self._max_age_s
        if (reference_s := self.reference_s) is not None:
            limit_s = min(limit_s, reference_s + self._ttl_s(ttl_max_s or self._command_ttl_max_s))
        if age_s > limit_s:
            return Verdict(because(Code.TOO_OLD, age_s=age_s, limit_s=limit_s, what=what), age_s)
        return Verdict(None, age_s)

    def renew(self, echo: Stamp | None) -> Verdict:
        """Judge a lease renewal, and learn the usual age from it."""
        verdict = self.judge(echo, what="renewal")
        if verdict.age_s is None or verdict.age_s < 0.0 or echo is None:
            return verdict  # nothing was measured: the next one is the first of its kind, not part of a burst
        now_s = self._clock.now_s()
        in_burst = now_s - self._last_renewal_s < _LEAST_GAP_S
        self._last_renewal_s = now_s
        in_order = echo.t_ns > self._last_echo_ns
        self._last_echo_ns = max(self._last_echo_ns, echo.t_ns)
        if in_burst or not in_order:
            self._late.clear()
            return verdict
        if verdict.reason is None:
            self._accepted.append(verdict.age_s)
            self._late.clear()
            return verdict
        self._late.append(verdict.age_s)
        spread_s = max(self._late) - min(self._late)
        if (
            len(self._late) < _WINDOW
            or max(self._late) > self._max_age_s
            or spread_s > self._command_ttl_max_s
        ):
            return verdict
        self._accepted, self._late = self._late, deque(maxlen=_WINDOW)
        return replace(verdict, delay_changed=True)

    def _ttl_s(self, upper_s: float) -> float:
        """Return the largest usual excess over the reference [s]."""
        spread_s = float(np.quantile(np.array(self._accepted), 0.99)) - min(self._accepted)
        return min(max(spread_s + 0.1, _TTL_MIN_S, self.two_reports_s), upper_s)
