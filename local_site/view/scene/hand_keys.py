"""Line of text by which a tab says what its keys and its gamepad do to the hand.

`hand_keys.js` sends one for each change, and twenty per second while something is held: the counted steps since the hand
began to move, and the present speed.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SILENT_S, SILENT_HERE_S = 0.3, 1.0
"""Silence of the tab after which the hand lets go: of the robot, and of the operator's own simulated arm, because a
browser that draws in software is late by more than the first [s]."""
_LINE = re.compile(
    r"(?P<burst>[a-z0-9]{1,12});(?P<steps>-?\d{1,5},-?\d{1,5},-?\d{1,5});(?P<held>[01]);"
    r"(?P<speed>-?[01]\.\d\d,-?[01]\.\d\d,-?[01]\.\d\d);\d{1,9}"
)


@dataclass(frozen=True, eq=False)
class HandLine:
    """One line of the tab.

    Args:
        burst: Name of the burst of lines; the steps are counted from its beginning.
        steps: Steps to the right, up, and in, so far. Shape (3,).
        held: True while a key or the dead-man button is held.
        speed: Share of the full speed to the right, up, and in, each from -1 to 1. Shape (3,).
    """

    burst: str
    steps: Array
    held: bool
    speed: Array

    @classmethod
    def parse(cls, text: str) -> HandLine | None:
        """Return a line; None if it is none."""
        found = _LINE.fullmatch(text)
        if found is None:
            return None
        steps, speed = (
            np.array([float(part) for part in found[name].split(",")]) for name in ("steps", "speed")
        )
        return cls(found["burst"], steps, found["held"] == "1", np.clip(speed, -1.0, 1.0))
