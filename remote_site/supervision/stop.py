"""STOP at the robot: it stops in every mode, whoever asks, and tells the sender when it stands still.

A control period handles stops before the other sites' messages (`inbox.py`). A stop is acknowledged on receipt and leads to
STOPPED (`ModeMachine.stop`), in which nothing moves the plant, so that it brakes. Once it stands still the stop is
acknowledged again. Reset alone leaves STOPPED.
"""

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
        self._known: dict[str, list[StopAck]] = {}  # by id: that it came, and that the robot stood since

    def receive(self, stop_id: str, now: Stamp) -> bool:
        """Acknowledge a stop. Return True if the robot is not STOPPED for it yet."""
        new = stop_id not in self._known
        if new and len(self._known) >= _MOST_KNOWN:
            del self._known[next(iter(self._known))]
        acks = self._known.setdefault(stop_id, [StopAck(stop_id=stop_id, standing=False, stamp=now)])
        for ack in acks:  # the same again: one copy of each is enough on the reliable way
            self._acknowledge(ack)
        return new

    def stands(self, now: Stamp) -> None:
        """Acknowledge the pending stops, now that the robot stands still."""
        for stop_id, acks in self._known.items():
            if not acks[-1].standing:
                acks.append(StopAck(stop_id=stop_id, standing=True, stamp=now))
                self._acknowledge(acks[-1])

    def forget(self) -> None:
        """Forget all stops: the robot leaves STOPPED."""
        self._known.clear()
