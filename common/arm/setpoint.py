"""Setpoint: the virtual body of unit mass that accelerations move and the arm follows.

An arm that integrated accelerations from where it is measured would drift with every error of its servos.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.kinematics import difference, moved, shortened
from farhand.common.arm.robot_file import RobotFile
from farhand.common.errors import InvalidConfiguration

Array = NDArray[np.float64]

_LEAD_M, _LEAD_RAD = 0.010, 0.1
"""Largest lead of the setpoint over the arm, in position [m] and rotation [rad]."""


@dataclass(frozen=True)
class MotionLimits:
    """Limits that the arm never exceeds, whatever is commanded.

    Args:
        low_m: Corner of the box that confines the tip, from the base. Length 3 [m].
        high_m: The opposite corner. Length 3 [m].
        speed_m_s: Speed of the tip, relative to the receptacle if that is near [m/s].
        angular_speed_rad_s: Angular speed of the tool [rad/s].
        acceleration_m_s2: Acceleration of the tip [m/s^2].
        angular_acceleration_rad_s2: Angular acceleration of the tool [rad/s^2].

    Raises:
        InvalidConfiguration: When a limit is not positive or the box is empty.
    """

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]
    speed_m_s: float = 0.15
    angular_speed_rad_s: float = 0.6
    acceleration_m_s2: float = 1.0
    angular_acceleration_rad_s2: float = 3.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, float) and not 0.0 < value < np.inf:
                raise InvalidConfiguration("motion limits", name, f"a positive number, got {value}")
        if not all(low < high for low, high in zip(self.low_m, self.high_m, strict=True)):
            raise InvalidConfiguration("motion limits", "low_m", f"below high_m, got {self.low_m}")

    @classmethod
    def of(cls, robot: RobotFile) -> MotionLimits:
        """Return the limits of a robot."""
        return cls(robot.limits.workspace_low_m, robot.limits.workspace_high_m)


class Setpoint:
    """Pose and velocity that the arm should have.

    Args:
        limits: Limits of the motion.
        pose: First pose. Shape (7,).
    """

    def __init__(self, limits: MotionLimits, pose: Array):
        self._limits = limits
        self._low, self._high = np.array(limits.low_m), np.array(limits.high_m)
        self.pose = pose.copy()
        self.velocity = np.zeros(6)
        """Tangent at the pose [m/s, rad/s]. Shape (6,)."""

    def accelerate(self, acceleration: Array, carried: Array, dt_s: float) -> Array:
        """Apply an acceleration for one period; return the mean velocity in it. Shape (6,).

        Args:
            acceleration: Shape (6,) [m/s^2, rad/s^2].
            carried: Velocity that the speed limit is relative to. Shape (6,).
            dt_s: The period [s].
        """
        limits, u = self._limits, np.empty(6)
        u[:3] = shortened(acceleration[:3], limits.acceleration_m_s2)
        u[3:] = shortened(acceleration[3:], limits.angular_acceleration_rad_s2)
        relative = self.velocity + dt_s * u - carried
        following = carried.copy()
        following[:3] += shortened(relative[:3], limits.speed_m_s)
        following[3:] += shortened(relative[3:], limits.angular_speed_rad_s)
        mean = 0.5 * (self.velocity + following)
        reached = moved(self.pose, dt_s * mean)
        inside = np.minimum(np.maximum(reached[:3], self._low), self._high)
        stopped = inside != reached[:3]
        if stopped.any():
            following[:3][stopped] = 0.0
            mean[:3] = (inside - self.pose[:3]) / dt_s
            reached[:3] = inside
        self.pose, self.velocity = reached, following
        return mean

    def follow(self, tip: Array) -> None:
        """Pull the setpoint back towards an arm that could not follow."""
        lead = difference(tip, self.pose)
        near = np.concatenate([shortened(lead[:3], _LEAD_M), shortened(lead[3:], _LEAD_RAD)])
        if not np.array_equal(near, lead):
            self.pose = moved(tip, near)

    def pull_back(self, axis: Array, by_m: float, speed_m_s: float) -> None:
        """Move back along an axis, and limit the speed along it.

        Args:
            axis: Unit vector, in the axes of the base. Shape (3,).
            by_m: Distance, no movement when negative [m].
            speed_m_s: Largest velocity along the axis [m/s].
        """
        self.pose[:3] -= max(by_m, 0.0) * axis
        self.velocity[:3] -= max(float(self.velocity[:3] @ axis) - speed_m_s, 0.0) * axis
