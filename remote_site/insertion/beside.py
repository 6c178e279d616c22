"""The "beside" rule: the receptacle jumped, and the plug is at or behind its mouth, but not in it.

A motion that is not told would go on inserting and push the receptacle from the side. An error of the
estimate along the axis looks the same, so that the rule waits for a jump.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_BEHIND_M, _LATERAL_M = -0.020, 0.020
# In the mouth, within its chamfer, the jump is over.
_INSIDE_M = 0.005


class BesideRule:
    """Armed by a jump, until the plug is in the bore."""

    def __init__(self) -> None:
        self._armed = False

    def jumped(self) -> None:
        """The receptacle was found elsewhere."""
        self._armed = True

    def beside(self, tip_m: NDArray[np.float64]) -> bool:
        """Whether the plug must go back before it can come in.

        Args:
            tip_m: Of the plug, in the frame of the receptacle: z points into the bore. Shape (3,) [m].
        """
        lateral_m = float(np.hypot(tip_m[0], tip_m[1]))
        if tip_m[2] > 0.0 and lateral_m < _INSIDE_M:
            self._armed = False
        return self._armed and tip_m[2] > _BEHIND_M and lateral_m > _LATERAL_M
