"""Kinematic pre-flight check: whether the arm can move the last 20 cm into a receptacle with a bent wrist.

An arm that can no longer turn its tool freely jams in the bore; the check finds this before the motion
starts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.insertion_trajectory import InsertionTrajectory
from farhand.common.arm.kinematics import Kinematics
from farhand.common.arm.poses import difference

Array = NDArray[np.float64]

REFUSED_BELOW = 0.02
"""Least singular value below which an insertion is refused."""
WARNED_BELOW = 0.03
"""Least singular value below which the operator is warned."""

_WORST_M, _WORST_RAD = 0.002, np.radians(1.0)


@dataclass(frozen=True)
class Preflight:
    """Result of a pre-flight check.

    Args:
        least_singular_value: Least singular value of the Jacobian along the path, with a radian weighted as
            0.3 m.
        worst_m: Largest position error of the tip [m].
        worst_rad: Largest orientation error of the tool [rad].
    """

    least_singular_value: float
    worst_m: float
    worst_rad: float

    @property
    def refusal(self) -> str:
        """Reason not to begin the insertion; empty when it may begin."""
        if self.worst_m > _WORST_M or self.worst_rad > _WORST_RAD:
            away = f"{1e3 * self.worst_m:.0f} mm and {np.degrees(self.worst_rad):.0f} degrees"
            return f"the receptacle is out of the arm's reach: the way in is missed by {away}"
        if self.least_singular_value < REFUSED_BELOW:
            return f"the wrist would be straight on the way in ({self.least_singular_value:.3f})"
        return ""

    @property
    def warning(self) -> str:
        """Warning for the operator before the insertion; empty for none."""
        if not self.refusal and self.least_singular_value < WARNED_BELOW:
            return f"the wrist is nearly straight on the way in ({self.least_singular_value:.3f})"
        return ""


class Preflights:
    """Pre-flight checks of one arm.

    Args:
        kinematics: A copy for this purpose alone.
    """

    def __init__(self, kinematics: Kinematics):
        self._way_in = InsertionTrajectory(kinematics)

    def examine(self, joints_rad: Array, receptacle: Array) -> Preflight:
        """Move from these angles straight to a point before the receptacle, then into it.

        Args:
            joints_rad: Present joint angles. Shape (6,) [rad].
            receptacle: Pose of the receptacle. Shape (7,).
        """
        kinematics = self._way_in.kinematics
        least, worst = np.inf, np.zeros(2)
        for pose in self._way_in.go(joints_rad, receptacle):
            error = difference(kinematics.tip, pose)
            worst = np.maximum(worst, [np.linalg.norm(error[:3]), np.linalg.norm(error[3:])])
            least = min(least, kinematics.least_singular_value())
        return Preflight(float(least), *worst.tolist())
