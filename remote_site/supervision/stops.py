"""The stops that were asked for: each is acknowledged when received and again when the robot stands."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from farhand.common.wire.messages import Stamp, StopAck


class Stops:
    """Acknowledges each stop twice, and again whenever it is resent.

    Args:
        acknowledge: Sends an acknowledgement.
    """

    def __init__(self, acknowledge: Callable[[StopAck], None]):
        self._acknowledge = acknowledge
        self._braking: list[str] = []
        self._standing: deque[str] = deque(maxlen=64)

    def receive(self, stop_id: str, now: Stamp) -> bool:
        """Acknowledge a stop as received. True when it is a new one."""
        new = stop_id not in self._braking and stop_id not in self._standing
        if new:
            self._braking.append(stop_id)
        self._acknowledge(StopAck(stop_id=stop_id, standing=False, stamp=now))
        if stop_id in self._standing:
            self._acknowledge(StopAck(stop_id=stop_id, standing=True, stamp=now))
        return new

    def stands(self, now: Stamp) -> None:
        """The robot stands still: acknowledge what waited for that."""
        for stop_id in self._braking:
            self._standing.append(stop_id)
            self._acknowledge(StopAck(stop_id=stop_id, standing=True, stamp=now))
        self._braking.clear()
