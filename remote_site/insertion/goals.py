"""Goals of manoeuvres at a receptacle: out of the bore along its axis, with no sideways motion inside.

In the frame of the receptacle the mouth is the origin, and z points into the bore.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.remote_site.insertion.receptacle_estimator import InsertionArm
from farhand.remote_site.interface.goals import SPEED, patience_s
from farhand.remote_site.interface.sensing import Sensing

Array = NDArray[np.float64]

IN_BORE_M_S = 0.03
"""Speed of manoeuvres where the plug touches, or may touch [m/s]."""
_LEAD_M = 0.020
"""Largest lead of the hand over a plug in the bore [m]."""
_BESIDE_M = 0.040
"""Distance from the axis beyond which no plug is in the bore, whatever the error of sight [m]."""


class AlongAxis:
    """Goal pose that moves with the receptacle.

    Args:
        local: Goal pose in the frame of the receptacle. Shape (7,).
        sensing: Newest measurements; they hold the receptacle's frame.
        arm: Arm; it knows whether the plug is near the receptacle.
        speed_m_s: Speed in free water [m/s].
        distance_m: Length of the path [m].
        time_limit_s: See `ManoeuvreGoal`; derived from the distance when not given.
    """

    def __init__(
        self,
        local: Array,
        sensing: Sensing,
        arm: InsertionArm,
        speed_m_s: float,
        distance_m: float,
        time_limit_s: float | None = None,
    ):
        self._local, self._sensing, self._arm, self._speed = local, sensing, arm, speed_m_s
        self.time_limit_s = patience_s(distance_m, IN_BORE_M_S) if time_limit_s is None else time_limit_s

    def goal(self) -> Array:
        """See `ManoeuvreGoal`."""
        return self._sensing.frames[0].to_world(self._local)

    def speed_m_s(self) -> float:
        """See `ManoeuvreGoal`."""
        return min(self._speed, IN_BORE_M_S) if self._arm.near else self._speed


def shifted(sensing: Sensing, by_m: Array) -> Array:
    """Return the tip's pose in the receptacle's frame, displaced along its axes. Shapes (3,), (7,)."""
    local = sensing.frames[0].to_local(sensing.effector.controlled[0])
    local[:3] += by_m
    return local


def in_bore(sensing: Sensing) -> bool:
    """Decide whether the tip is behind the mouth, as far as that is known."""
    if not np.isfinite(sensing.unseen_s):
        return False
    x, y, z = sensing.frames[0].to_local(sensing.effector.point)[:3]
    return bool(z > 0.0 and np.hypot(x, y) < _BESIDE_M)


def confined(reference: Array, sensing: Sensing) -> Array:
    """Confine the operator's reference: inside the bore the plug moves along the axis only. Shapes (7,)."""
    if not in_bore(sensing):
        return reference
    axis, at = sensing.frames[0].A[:, 2], sensing.effector.controlled[0].copy()
    along_m = float((reference[:3] - at[:3]) @ axis)
    at[:3] += min(max(along_m, -_LEAD_M), _LEAD_M) * axis
    return at


def free_speed_m_s(fastest_m_s: float) -> float:
    """Return the speed of manoeuvres in free water [m/s]."""
    return SPEED * fastest_m_s
