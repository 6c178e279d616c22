"""The common rule for stale commands, to compare with: the receiver's clock minus the sender's stamp.

It is what several systems do (MoveIt Servo: `now - header.stamp` above 0.1 s is stale; dimos: 0.5 s), with
a mark of the newest sequence number beside it, so that what arrives twice or out of order counts once.
It is right as long as the two clocks agree.
"""

from __future__ import annotations


class StampRule:
    """Judges by two wall clocks.

    Args:
        ttl_s: How old a message may be [s].
    """

    def __init__(self, ttl_s: float):
        self._ttl_s = ttl_s
        self._newest_seq = -1

    def restart(self) -> None:
        """The receiver is started again: what it remembered is gone."""
        self._newest_seq = -1

    def accepts(self, seq: int, stamp_s: float, now_s: float) -> bool:
        """Whether a message counts.

        Args:
            seq: Its sequence number.
            stamp_s: When it was sent, on the sender's wall clock [s].
            now_s: Now, on the receiver's wall clock [s].
        """
        if seq <= self._newest_seq or now_s - stamp_s > self._ttl_s:
            return False
        self._newest_seq = seq
        return True
