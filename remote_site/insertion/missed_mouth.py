"""Detection of a plug that missed the mouth because the receptacle moved away.

An uninformed motion would go on inserting and push the receptacle from the side, or start its approach again
from far away, which takes longer than all the rest. So a plug at or behind the mouth retreats straight back,
a plug in front of the mouth moves onto the axis, and there the motion resumes. An error of the estimate along
the axis looks like a plug beside the mouth; therefore the detector waits until the receptacle has jumped or
the plug has lost the axis.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Closer to the axis than the first: on the axis. Farther than the second: off it, however noisy the sight is.
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
        """Record that the receptacle was found elsewhere."""
        self._armed = self._off_axis = True

    def goal_m(self, tip_m: Array) -> Array | None:
        """Return the next point on the way back to the axis, or None if the motion may go on. Shape (3,) [m].

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
