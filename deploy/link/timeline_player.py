"""Plays a link's timeline in real time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from farhand.common.impairment.impairment import LinkSettings
from farhand.common.impairment.timeline import Timeline


class TimelinePlayer:
    """Applies the settings of a timeline, each when its time has come, in the running event loop.

    Args:
        apply: Puts settings into force.
    """

    def __init__(self, apply: Callable[[LinkSettings], None]):
        self._apply = apply
        self._next: asyncio.TimerHandle | None = None

    def play(self, timeline: Timeline) -> None:
        """Begin a timeline now, instead of the one under way."""
        self.stop()
        self._take(timeline, asyncio.get_running_loop().time(), 0.0)

    def stop(self) -> None:
        """Leave the settings as they are."""
        if self._next:
            self._next.cancel()
        self._next = None

    def _take(self, timeline: Timeline, began_s: float, elapsed_s: float) -> None:
        self._apply(timeline.at(elapsed_s))
        if (next_s := timeline.next_change_s(elapsed_s)) is not None:
            loop = asyncio.get_running_loop()
            self._next = loop.call_at(began_s + next_s, self._take, timeline, began_s, next_s)
