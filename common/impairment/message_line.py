"""Effect of an impaired link on messages: each may be late, lost, duplicated, corrupted or reordered."""

from __future__ import annotations

import heapq
import math
from random import Random
from typing import NamedTuple

from farhand.common.impairment.burst_loss import Loss
from farhand.common.impairment.delay_line import Jitter
from farhand.common.impairment.impairment import DirectionSettings


class Arrival(NamedTuple):
    """Arrival of one copy of a message.

    Args:
        due_s: Time of the arrival [s].
        corrupted_at: Place of the one inverted bit, as a share of the length from 0 to below 1; None for an intact copy.
    """

    due_s: float
    corrupted_at: float | None = None

    def received(self, data: bytes) -> bytes:
        """Return the message as it arrives."""
        if self.corrupted_at is None or not data:
            return data
        byte, bit = divmod(int(self.corrupted_at * 8 * len(data)), 8)
        return data[:byte] + bytes([data[byte] ^ 1 << bit]) + data[byte + 1 :]


class MessageLine:
    """One direction of a link of messages, which draws the arrivals of each message.

    Each impairment has its own random sequence, so that a change of one leaves the others as they are. A
    message that is lost in transit has still taken its time to send.

    Args:
        settings: Parameters of the line.
        stream: Name of the line; each has its own random sequences.
        is_path: True if the messages are packets on one path: they queue up, so jitter keeps their order, and only
            `reorder` changes it. False for messages that travel independently.
    """

    def __init__(self, settings: DirectionSettings, stream: str = "", is_path: bool = False):
        self._settings = settings
        self._stream, self._is_path = stream, is_path
        self._latest_s = -math.inf  # latest arrival of a packet that was not reordered
        self._sent_s = -math.inf  # time when the last bit leaves the sender
        self._under_way: list[tuple[float, int]] = []  # heap of (due, bytes)
        self._under_way_bytes = 0
        self._since_reordered = 0
        self._seed_all()

    @property
    def settings(self) -> DirectionSettings:
        """Present parameters."""
        return self._settings

    def push(self, now_s: float, n_bytes: int) -> list[Arrival]:
        """Send a message.

        Args:
            now_s: The time [s], on any clock that does not go back.
            n_bytes: Size of the message.

        Returns:
            The arrivals: none of a lost message, two of a duplicated one. With reorder, and with jitter except on a path,
            a later message may arrive earlier.
        """
        settings = self._settings
        sending_s = 8 * n_bytes / settings.rate_bps if settings.rate_bps else 0.0
        self._sent_s = max(now_s, self._sent_s) + sending_s
        if self._loss.is_lost():
            return []
        arrivals = [Arrival(self._draw_due_s(), self._draw_corruption())]
        if settings.duplicate and self._duplicate.random() < settings.duplicate / 100:
            arrivals.append(Arrival(self._sent_s + self._jitter.draw_s(settings), self._draw_corruption()))
        self._forget_arrived(now_s)
        heapq.heappush(self._under_way, (arrivals[0].due_s, n_bytes))
        self._under_way_bytes += n_bytes
        return arrivals

    @property
    def next_arrival_s(self) -> float | None:
        """Arrival time of the next message in transit [s]; None for none."""
        return self._under_way[0][0] if self._under_way else None

    def free_bytes(self, now_s: float) -> int:
        """Return the room for bytes at that time; a sender without room has to wait or to drop."""
        self._forget_arrived(now_s)
        return max(0, self._settings.queue_limit_bytes - self._under_way_bytes)

    def clear(self) -> None:
        """Lose everything in transit, so that it no longer delays later messages."""
        self._sent_s = self._latest_s = -math.inf
        self._under_way.clear()
        self._under_way_bytes = 0

    def change(self, settings: DirectionSettings) -> None:
        """Replace the parameters for later messages; messages in transit keep their times."""
        reseed = settings.seed != self._settings.seed
        self._settings, self._latest_s = settings, -math.inf  # another path may be shorter
        if reseed:
            self._seed_all()
        else:
            self._loss.change(settings)

    def _seed_all(self) -> None:
        def chance(purpose: str) -> Random:
            return Random(f"{self._settings.seed}/{self._stream}/{purpose}")

        self._loss = Loss(self._settings, chance("loss"))
        self._jitter = Jitter(chance("jitter"))
        self._duplicate = chance("duplicate")
        self._reorder = chance("reorder")
        self._corrupt = chance("corrupt")

    def _forget_arrived(self, now_s: float) -> None:
        while self._under_way and self._under_way[0][0] <= now_s:
            self._under_way_bytes -= heapq.heappop(self._under_way)[1]

    def _draw_corruption(self) -> float | None:
        corrupt = self._settings.corrupt
        return self._corrupt.random() if corrupt and self._corrupt.random() < corrupt / 100 else None

    def _draw_due_s(self) -> float:
        settings = self._settings
        if settings.reorder:
            self._since_reordered += 1
            if self._since_reordered >= settings.gap and self._reorder.random() < settings.reorder / 100:
                self._since_reordered = 0
                return self._draw_early_s()
        due_s = self._sent_s + self._jitter.draw_s(settings)
        if self._is_path:
            due_s = self._latest_s = max(due_s, self._latest_s)
        return due_s

    def _draw_early_s(self) -> float:
        settings = self._settings
        if not settings.reorder_ms:
            return self._sent_s
        return max(self._sent_s, self._sent_s + self._jitter.draw_s(settings) - settings.reorder_ms / 1000)
