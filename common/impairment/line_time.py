"""The time on a line, which stands still while the line is stalled."""

from __future__ import annotations

import math


class LineTime:
    """Maps the caller's time to the line's own and back.

    A stall is a stretch of the caller's time that does not exist on the line; so order, rate and spacing
    hold after it as before.
    """

    def __init__(self) -> None:
        self._resume_s = -math.inf
        self._behind_s = 0.0

    def on_line(self, now_s: float) -> float:
        """The line's time at the caller's `now_s` [s]."""
        return max(now_s, self._resume_s) - self._behind_s

    def of_caller(self, line_s: float) -> float:
        """The caller's time when the line's is `line_s` [s], unless there is another stall before that."""
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
