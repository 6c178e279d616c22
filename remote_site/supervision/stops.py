"""Acknowledgement of stops: each on receipt, and again when the robot stands still."""

from __future__ import annotations

from collections.abc import Callable

from farhand.common.wire.messages import Stamp, StopAck

_MOST_KNOWN = 64


class Stops:
    """Stops received in the present STOPPED; forgotten once the robot leaves that mode.

    A resent stop is only acknowledged while the robot is STOPPED. After a Reset it stops the robot
    again: its sender has not heard that the robot stood, and expects it to stand.

    Args:
        acknowledge: Sends an acknowledgement.
    """

    def __init__(self, acknowledge: Callable[[StopAck], None]):
        self._acknowledge = acknowledge
        self._known: dict[str, bool] = {}  # by id, whether the robot stood since

    def receive(self, stop_id: str, now: Stamp) -> bool:
        """Acknowledge a stop. Return True if the robot is not STOPPED for it yet."""
        new = stop_id not in self._known
        if new and len(self._known) >= _MOST_KNOWN:
            del self._known[next(iter(self._known))]
        self._known.setdefault(stop_id, False)
        self._acknowledge(StopAck(stop_id=stop_id, standing=False, stamp=now))
        if self._known[stop_id]:
            self._acknowledge(StopAck(stop_id=stop_id, standing=True, stamp=now))
        return new

    def stands(self, now: Stamp) -> None:
        """Acknowledge the pending stops, now that the robot stands still."""
        for stop_id, stood in self._known.items():
            if not stood:
                self._known[stop_id] = True
                self._acknowledge(StopAck(stop_id=stop_id, standing=True, stamp=now))

    def forget(self) -> None:
        """Forget all stops: the robot leaves STOPPED."""
        self._known.clear()
