"""Kinematic pre-flight: can the arm go the last 20 cm into a receptacle, with the wrist never straight?

Where the arm cannot turn its tool freely any more it jams in the bore, so that is found out before it starts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.robot import arm
from common.robot.engine import mink
from common.robot.kinematics import Kinematics
from common.robot.poses import compose, difference, moved

Array = NDArray[np.float64]

WAY_M = 0.20
"""How much of the way into the receptacle is looked at [m]."""
REFUSED_BELOW = 0.02
"""Least singular value with which an insertion is refused."""
WARNED_BELOW = 0.03
"""The same for a warning."""

_STEP_M, _STEP_RAD = 0.005, 0.05
_ITERATIONS = 4
_DAMPING = 1e-6
_WORST_M, _WORST_RAD = 0.002, np.radians(1.0)


@dataclass(frozen=True)
class Preflight:
    """What was found.

    Args:
        least_singular_value: Of the Jacobian along the way, with a radian worth 0.3 m.
        worst_m: Largest distance between the tip and where it should be [m].
        worst_rad: Largest angle between the tool and what it should have [rad].
    """

    least_singular_value: float
    worst_m: float
    worst_rad: float

    @property
    def refusal(self) -> str:
        """Why the insertion should not be begun; empty when it may be."""
        if self.worst_m > _WORST_M or self.worst_rad > _WORST_RAD:
            away = f"{1e3 * self.worst_m:.0f} mm and {np.degrees(self.worst_rad):.0f} degrees"
            return f"the receptacle is out of the arm's reach: the way in is missed by {away}"
        if self.least_singular_value < REFUSED_BELOW:
            return f"the wrist would be straight on the way in ({self.least_singular_value:.3f})"
        return ""

    @property
    def warning(self) -> str:
        """What the operator should know before; empty for nothing."""
        if not self.refusal and self.least_singular_value < WARNED_BELOW:
            return f"the wrist is nearly straight on the way in ({self.least_singular_value:.3f})"
        return ""


class Preflights:
    """Examines insertions of one arm.

    Args:
        kinematics: A copy for this purpose alone.
    """

    def __init__(self, kinematics: Kinematics):
        self._kinematics = kinematics
        self._limits = [mink.ConfigurationLimit(kinematics.model)]
        self._task = mink.FrameTask(arm.TIP, "site", position_cost=1.0, orientation_cost=0.3)

    def examine(self, joints_rad: Array, receptacle: Array) -> Preflight:
        """Go from these angles straight to before the receptacle, then into it.

        Args:
            joints_rad: Where the arm is. Shape (6,) [rad].
            receptacle: Its pose. Shape (7,).
        """
        kinematics = self._kinematics
        kinematics.update(joints_rad)
        depth_m = kinematics.dimensions.receptacle.depth_m
        for pose in _straight(kinematics.tip, _in_bore(receptacle, depth_m - WAY_M)):
            self._reach(pose)
        least, worst = np.inf, np.zeros(2)
        for depth in np.linspace(depth_m - WAY_M, depth_m, round(WAY_M / _STEP_M) + 1):
            pose = _in_bore(receptacle, depth)
            self._reach(pose)
            error = difference(kinematics.tip, pose)
            worst = np.maximum(worst, [np.linalg.norm(error[:3]), np.linalg.norm(error[3:])])
            least = min(least, kinematics.least_singular_value())
        return Preflight(float(least), *worst.tolist())

    def _reach(self, pose: Array) -> None:
        configuration = self._kinematics.configuration
        self._task.set_target(mink.SE3(np.concatenate([pose[3:], pose[:3]])))
        for _ in range(_ITERATIONS):
            velocity = mink.solve_ik(
                configuration, [self._task], 1.0, "daqp", damping=_DAMPING, limits=self._limits
            )
            configuration.integrate_inplace(velocity, 1.0)


def _in_bore(receptacle: Array, depth_m: float) -> Array:
    return compose(receptacle, np.array([0.0, 0.0, depth_m, 1.0, 0.0, 0.0, 0.0]))


def _straight(start: Array, end: Array) -> list[Array]:
    """Poses on the way from one to another, not further apart than a step."""
    way = difference(start, end)
    steps = max(np.linalg.norm(way[:3]) / (4 * _STEP_M), np.linalg.norm(way[3:]) / _STEP_RAD, 1.0)
    return [moved(start, part * way) for part in np.linspace(0.0, 1.0, int(np.ceil(steps)) + 1)[1:]]
