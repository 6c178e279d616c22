"""A slow link's effect on a stream of bytes, and the clock of a line, which stands still while the line is stalled.

A byte never overtakes an earlier one, whatever its jitter.
"""

from __future__ import annotations

import math
from collections import deque
from random import Random

from farhand.common.impairment.impairment import DirectionSettings
from farhand.common.impairment.jitter import Jitter


class DelayLine:
    """One direction of one connection: decides when each piece arrives, and how much may still be sent.

    Args:
        settings: The line's parameters. Those of messages (loss, duplicate, reorder) are without meaning.
        stream: Name of the stream; each has a random sequence of its own.
    """

    def __init__(self, settings: DirectionSettings, stream: str = ""):
        self._settings = settings
        self._stream = stream
        self._jitter = self._new_jitter()
        self._time = LineTime()
        self._queue: deque[tuple[float, int]] = deque()  # (due in the line's own time, bytes)
        self._queued_bytes = 0
        self._sent_s = -math.inf  # when the last bit has left the sender
        self._last_due_s = -math.inf

    @property
    def settings(self) -> DirectionSettings:
        """The parameters in force."""
        return self._settings

    @property
    def queued_bytes(self) -> int:
        """Bytes pushed and not yet popped."""
        return self._queued_bytes

    @property
    def free_bytes(self) -> int:
        """Bytes that may be pushed now. A sender who respects it never exceeds the bound of the queue."""
        return max(0, self._settings.queue_limit_bytes - self._queued_bytes)

    @property
    def next_due_s(self) -> float | None:
        """Arrival time of the oldest piece [s], None if nothing is under way."""
        return self._time.of_caller(self._queue[0][0]) if self._queue else None

    def push(self, now_s: float, n_bytes: int) -> float:
        """Send a piece; one of no bytes (the end of the stream) takes its place in the order, too.

        Args:
            now_s: The time [s], on any clock that does not go back.
            n_bytes: Size of the piece.

        Returns:
            When it arrives [s], unless the line is stalled before that.
        """
        start_s = max(self._time.on_line(now_s), self._sent_s)
        rate_bps = self._settings.rate_bps
        self._sent_s = start_s + (8 * n_bytes / rate_bps if rate_bps else 0.0)
        self._last_due_s = max(self._sent_s + self._jitter.draw_s(self._settings), self._last_due_s)
        self._queue.append((self._last_due_s, n_bytes))
        self._queued_bytes += n_bytes
        return self._time.of_caller(self._last_due_s)

    def pop(self) -> int:
        """Take the oldest piece off the line; returns its size [B].

        Raises:
            IndexError: Nothing is under way.
        """
        _, n_bytes = self._queue.popleft()
        self._queued_bytes -= n_bytes
        return n_bytes

    def clear(self) -> None:
        """Lose everything under way."""
        self._queue.clear()
        self._queued_bytes = 0

    def change(self, settings: DirectionSettings) -> None:
        """Replace the parameters for what is pushed from now on; what is under way keeps its times."""
        reseed = settings.seed != self._settings.seed
        self._settings = settings
        if reseed:
            self._jitter = self._new_jitter()

    def stall(self, now_s: float, until_s: float) -> None:
        """Let time stand still on the line.

        Args:
            now_s: The time [s].
            until_s: When it goes on [s]; replaces an earlier stall, and `now_s` ends it.
        """
        self._time.stall(now_s, until_s)

    def _new_jitter(self) -> Jitter:
        return Jitter(Random(f"{self._settings.seed}/{self._stream}"))


class LineTime:
    """Maps the caller's time to the line's own and back.

    A stall is a stretch of the caller's time that does not exist on the line; so order, rate and spacing
    hold after it as before.
    """

    def __init__(self) -> None:
        self._resume_s = -math.inf
        self._behind_s = 0.0

    def on_line(self, now_s: float) -> float:
        """Convert the caller's time into the line's [s]."""
        return max(now_s, self._resume_s) - self._behind_s

    def of_caller(self, line_s: float) -> float:
        """Convert the line's time into the caller's [s], assuming no further stall until then."""
        return line_s + self._behind_s

    def stall(self, now_s: float, until_s: float) -> None:
        """Stand still.

        Args:
            now_s: The caller's time [s].
            until_s: When it goes on [s]; replaces an earlier stall, and `now_s` or less ends it.
        """
        frozen_s = self.on_line(now_s)
        self._resume_s = max(now_s, until_s)
        self._behind_s = self._resume_s - frozen_s
