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
from farhand.common.wire.reasons import Code, Reason, because

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
    def refusal(self) -> Reason | None:
        """Reason not to begin the insertion; None when it may begin."""
        if self.worst_m > _WORST_M or self.worst_rad > _WORST_RAD:
            return because(Code.OUT_OF_REACH, missed_m=self.worst_m, missed_rad=self.worst_rad)
        if self.least_singular_value < REFUSED_BELOW:
            return because(Code.WRIST_STRAIGHT, singular_value=self.least_singular_value)
        return None

    @property
    def warning(self) -> Reason | None:
        """Warning for the operator before the insertion; None for none."""
        if self.refusal is None and self.least_singular_value < WARNED_BELOW:
            return because(Code.WRIST_NEARLY_STRAIGHT, singular_value=self.least_singular_value)
        return None


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
