"""Hand on a board without a mouse: a gamepad draws and drives while its dead-man button is held, keys drive while held."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene.hand_keys import SILENT_HERE_S, SILENT_S, HandLine

Array = NDArray[np.float64]

_SPEED_M_S = 0.25
_LONGEST_S = 0.1


class BoardJog:
    """Motion of the hand on the operator's board. Used by the page's thread.

    Args:
        drag: Moves the hand: given "start", "update" or "end", and its position [m].
        size_m: Width and height of the board [m].
    """

    def __init__(self, drag: Callable[[str, tuple[float, float]], None], size_m: tuple[float, float]):
        self._drag, self._size_m = drag, np.array(size_m)
        self._line: HandLine | None = None
        self._heard_s = self._stepped_s = float("-inf")
        self._at: Array | None = None
        self._drives = self._spent = False

    def turns(self) -> bool:
        """Decide whether keys and gamepad turn the hand: a point has no direction."""
        return False

    def hear(self, text: str, now_s: float) -> None:
        """Take a line of the active tab; anything else is ignored.

        Args:
            text: The line.
            now_s: Now [s].
        """
        line = HandLine.parse(text)
        if line is not None:
            self._line, self._heard_s = line, now_s

    def step(self, state: ConsoleState, now_s: float) -> None:
        """Move the hand on; called thirty times a second.

        Args:
            state: State of the console.
            now_s: Now [s].
        """
        line = self._line
        duration_s, self._stepped_s = min(now_s - self._stepped_s, _LONGEST_S), now_s
        silent = now_s - self._heard_s > (SILENT_S if state.coupled else SILENT_HERE_S)
        if line is None or not line.held or silent or not (state.recording or state.coupled):
            self.let_go()
            self._spent = line is not None and line.held and not silent and self._spent
        elif self._at is not None and state.coupled != self._drives:
            self.let_go()
            self._spent = True  # what drew must never drive: first it is let go
        elif not self._spent:
            self._move(state, _SPEED_M_S * duration_s * line.speed[:2])

    def _move(self, state: ConsoleState, way: Array) -> None:
        if self._at is None:
            phase, self._at, self._drives = "start", self._begin(state), state.coupled
        else:
            phase, self._at = "update", np.clip(self._at + way, 0.0, self._size_m)
        self._drag(phase, (float(self._at[0]), float(self._at[1])))

    def _begin(self, state: ConsoleState) -> Array:
        """Return where the hand begins: at the robot, so that driving begins without a jump; while drawing, where the stroke is."""
        if state.recording and not state.coupled and len(state.strokes) > state.n_demonstrations:
            return np.array(state.strokes[-1][-1][:2])
        return np.array(state.robot.position_m[:2]) if state.robot is not None else 0.5 * self._size_m

    def let_go(self) -> None:
        """Let the hand go, at once."""
        if self._at is not None:
            at, self._at = self._at, None
            self._drag("end", (float(at[0]), float(at[1])))
