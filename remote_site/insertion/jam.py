"""Detection of a jammed plug: it presses, is not seated, and makes no progress.

Deep in the bore a plug stops for one of two reasons. A force or torque across the axis means that it jammed;
a force along the axis alone means that it reached the bottom, and that the receptacle is nearer than
believed.
"""

from __future__ import annotations

from collections import deque
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

# No progress: less than this distance within this time, under more than this force.
_PROGRESS_M, _WITHIN_S, _FORCE_N = 0.0015, 1.0, 15.0
# Believed depths between which a plug can jam, and the least depth at which it can have reached the bottom.
_FROM_M, _TO_M, _BOTTOM_M = -0.020, 0.070, 0.045
# Pressed straight: less force and torque across the axis than this.
_STRAIGHT_N, _STRAIGHT_NM = 6.0, 0.6


class Stuck(Enum):
    """Cause that stops a plug."""

    NO = auto()
    JAMMED = auto()
    AT_BOTTOM = auto()


class JamDetector:
    """Detector of jams from depth, force and torque."""

    def __init__(self) -> None:
        self._depths_m: deque[tuple[float, float]] = deque()

    def stuck(
        self, depth_m: float, force_n: NDArray[np.float64], torque_nm: NDArray[np.float64], now_s: float
    ) -> Stuck:
        """Return the cause that has stopped the plug for a second; restart the second when there is one.

        Args:
            depth_m: Believed depth of the tip behind the mouth [m].
            force_n: Force on the plug, in the axes of the receptacle. Shape (3,) [N].
            torque_nm: Torque on the plug about its tip, in the same axes. Shape (3,) [Nm].
            now_s: Present time [s].
        """
        if not _FROM_M < depth_m < _TO_M or float(np.linalg.norm(force_n)) < _FORCE_N:
            self._depths_m.clear()
            return Stuck.NO
        self._depths_m.append((now_s, depth_m))
        if now_s - self._depths_m[0][0] < _WITHIN_S:
            return Stuck.NO
        _, before_m = self._depths_m.popleft()
        if depth_m - before_m >= _PROGRESS_M:
            return Stuck.NO
        self._depths_m.clear()
        straight = np.hypot(*force_n[:2]) < _STRAIGHT_N and np.hypot(*torque_nm[:2]) < _STRAIGHT_NM
        return Stuck.AT_BOTTOM if straight and depth_m > _BOTTOM_M else Stuck.JAMMED
