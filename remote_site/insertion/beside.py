"""The "beside" rule: the receptacle moved away from before the plug, which is no longer on its axis.

A motion that is not told would go on inserting and push the receptacle from the side, or begin its approach once
more from far away, which takes longer than all the rest. So a plug that is at or behind the mouth goes straight
back, and one before it goes to the axis; there the motion goes on. An error of the estimate along the axis looks
like a plug beside the mouth, so the rule waits until the receptacle was found elsewhere, or the axis was lost.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Nearer than this to the axis the plug is on it; farther than this it is no more, however noisy the sight.
_ON_AXIS_M, _OFF_AXIS_M = 0.020, 0.030
_BEHIND_M = -0.020
# In the mouth, within its chamfer, the jump is over.
_INSIDE_M = 0.005
_STANDOFF_M = -0.090
# Farther away the approach is still to come.
_NEAR_M = -0.150


class BesideRule:
    """Watches a plug on its way in; armed when the axis is lost, until the plug is in the bore."""

    def __init__(self) -> None:
        self._on_axis = self._armed = self._off_axis = False

    def jumped(self) -> None:
        """The receptacle was found elsewhere."""
        self._armed = self._off_axis = True

    def goal_m(self, tip_m: Array) -> Array | None:
        """Return the next place on the way back to the axis, None where the motion may go on. Shape (3,) [m].

        Args:
            tip_m: Of the plug, in the frame of the receptacle: z points into the bore. Shape (3,) [m].
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
