"""The robot's U can be dragged on the remote board: that moves the simulated target."""

from __future__ import annotations

from collections.abc import Callable

from farhand.common.clock import elapsed_s
from farhand.local_site.console import intents

_PERIOD_S = 0.1


class TargetDrag:
    """Sends where the U is dragged to, at most ten times a second, and where it was let go.

    Args:
        submit: To the console.
    """

    def __init__(self, submit: Callable[[intents.Intent], None]):
        self._submit = submit
        self._sent_s = float("-inf")

    def drag(self, phase: str, position_m: tuple[float, float]) -> None:
        """The U is held at this point of the board [m]."""
        now_s = elapsed_s()
        if phase == "end" or now_s - self._sent_s >= _PERIOD_S:
            self._sent_s = now_s
            self._submit(intents.MoveTarget(position_m))
