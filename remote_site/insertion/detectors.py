"""Detectors of a failing insertion: a jammed plug, and a plug that missed the mouth.

Deep in the bore a plug stops for one of two reasons. A force or torque across the axis means that it jammed;
a force along the axis alone means that it reached the bottom, and that the receptacle is nearer than
believed.

Without a detector the motion would continue and push the receptacle from the side, or restart its approach
from far away, which takes longer than the rest of the insertion. So a plug at or behind the mouth retreats straight back,
a plug in front of the mouth moves onto the axis, and there the motion resumes. An error of the estimate along
the axis looks like a plug beside the mouth; therefore the detector waits until the receptacle has jumped or
the plug has lost the axis.
"""

from __future__ import annotations

from collections import deque
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

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


# Hysteresis: on the axis within the first distance, off it beyond the second, which exceeds the noise of sight.
_ON_AXIS_M, _OFF_AXIS_M = 0.020, 0.030
_BEHIND_M = -0.020
# Inside the mouth, within its chamfer, the plug has caught up with the jump.
_INSIDE_M = 0.005
_STANDOFF_M = -0.090
# Farther away, the approach has not begun yet.
_NEAR_M = -0.150


class MissedMouthDetector:
    """Detector of a plug beside the mouth; armed when the axis is lost, until the plug is in the bore."""

    def __init__(self) -> None:
        self._on_axis = self._armed = self._off_axis = False

    def jumped(self) -> None:
        """Note that the receptacle was found at another place."""
        self._armed = self._off_axis = True

    def goal_m(self, tip_m: Array) -> Array | None:
        """Return the next point on the way back to the axis, or None if the motion may continue. Shape (3,) [m].

        Args:
            tip_m: Position of the plug's tip in the frame of the receptacle, whose z axis points into the
                bore. Shape (3,) [m].
        """
        x, y, z = tip_m.tolist()
        lateral_m = float(np.hypot(x, y))
        if self._on_axis and lateral_m > _OFF_AXIS_M:
            self.jumped()
        self._on_axis = z > _NEAR_M and lateral_m < (_OFF_AXIS_M if self._on_axis else _ON_AXIS_M)
        if z > 0.0 and lateral_m < _INSIDE_M:
            self._armed = self._off_axis = False
        if not self._armed or lateral_m <= _ON_AXIS_M:
            return None
        if z > _BEHIND_M:
            self._off_axis = True
            return np.array([x, y, _STANDOFF_M])
        if not self._off_axis or z < _NEAR_M:
            return None
        self._off_axis = False
        return np.array([0.0, 0.0, min(z, _STANDOFF_M)])
