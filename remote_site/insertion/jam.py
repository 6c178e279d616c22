"""Whether a plug is stuck: it presses, is not where it should be, and gets no further.

Deep in the bore there are two reasons. A jammed plug is pressed aside or tilted; one that is pressed on
straight has reached the bottom, and the receptacle is nearer than it was believed to be.
"""

from __future__ import annotations

from collections import deque
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

# Less progress than this within so long a time, under more force than this, is none.
_PROGRESS_M, _WITHIN_S, _FORCE_N = 0.0015, 1.0, 15.0
# Where a plug that touches nothing, and one that is in, are believed to be at most; and the bottom at least.
_FROM_M, _TO_M, _BOTTOM_M = -0.020, 0.070, 0.045
# Pressed on straight: less force and torque across the axis than this.
_STRAIGHT_N, _STRAIGHT_NM = 6.0, 0.6


class Stuck(Enum):
    """What keeps a plug from going on."""

    NO = auto()
    JAMMED = auto()
    AT_BOTTOM = auto()


class JamDetector:
    """Watches depth, force and torque."""

    def __init__(self) -> None:
        self._depths_m: deque[tuple[float, float]] = deque()

    def stuck(
        self, depth_m: float, force_n: NDArray[np.float64], torque_nm: NDArray[np.float64], now_s: float
    ) -> Stuck:
        """What has kept the plug from going on for a second; begins anew when something did.

        Args:
            depth_m: Of the tip behind the mouth, as believed [m].
            force_n: On the plug, in the axes of the receptacle. Shape (3,) [N].
            torque_nm: On the plug about its tip, in the same axes. Shape (3,) [Nm].
            now_s: Now [s].
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
