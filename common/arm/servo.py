"""Servo: joint velocities that make the arm follow its setpoint, within limits of motion and of force."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.cell import Cell
from farhand.common.arm.compliance import ComplianceSettings, Governor, SeenReceptacle, Wrist, admittance
from farhand.common.arm.kinematics import Kinematics, difference, shortened
from farhand.common.arm.setpoint import MotionLimits, Setpoint
from farhand.common.arm.velocity_ik import Solution, VelocityIk, ramped

Array = NDArray[np.float64]

_GAIN_FREE_1_S, _GAIN_CONTACT_1_S = 10.0, 5.0
_FOLLOW_RAD_S = 8.0
"""Bandwidth of following a pose [rad/s]."""
_BRAKE_S = 0.1
"""Time constant of braking [s]."""
_OVERDRIVE_M, _OVERDRIVE_FROM_M, _OVERDRIVE_FULL_M = 0.015, 0.040, 0.070
"""Depth beyond its setpoint to which the plug is pushed, because the receptacle may be deeper than estimated [m]."""


@dataclass(frozen=True)
class ServoSettings:
    """Settings of the servo.

    Args:
        limits: Limits of the motion.
        compliance: Compliance in contact.
    """

    limits: MotionLimits
    compliance: ComplianceSettings = field(default_factory=ComplianceSettings)


class Servo:
    """Controller of one arm.

    Each control period call one of `accelerate`, `follow` and `brake`, then `measure`.

    Args:
        cell: The arm, with its tool and receptacle.
        settings: Settings of the motion.
        joints_rad: Present joint angles. Shape (6,) [rad].
    """

    def __init__(self, cell: Cell, settings: ServoSettings, joints_rad: Array):
        self.kinematics = Kinematics(cell)
        self.kinematics.update(joints_rad)
        self.wrist = Wrist(self.kinematics)
        self.wrist.tare()
        self.setpoint = Setpoint(settings.limits, self.kinematics.tip)
        self.governor = Governor(settings.compliance)
        self._settings = settings
        self._ik = VelocityIk(self.kinematics)
        self._seen: SeenReceptacle | None = None
        self._presses, self._held = True, False
        limits = cell.robot.limits
        self._accelerations = np.array(limits.acceleration_rad_s2)
        self._velocities = np.zeros(len(joints_rad))
        self.tip = self.kinematics.tip
        self.solution = Solution(np.zeros(len(joints_rad)), 0.0, 0.0)
        """Newest solution, including what the limits took away from it."""

    def set_receptacle(self, receptacle: SeenReceptacle | None, presses: bool = True) -> None:
        """Set the estimated pose of the receptacle, None while it is unknown; valid until the next call.

        Args:
            receptacle: Pose and velocity of the receptacle.
            presses: True to press the plug to the bottom of the bore. A plug that is to be extracted is
                never pushed further in than the motion asks for.
        """
        self._seen, self._presses = receptacle, presses
        self.kinematics.place_panel(receptacle.pose if receptacle else None)

    def measure(self, joints_rad: Array, wrench: Array) -> None:
        """Take the present measurements.

        Args:
            joints_rad: Shape (6,) [rad].
            wrench: Wrench on the tool about the wrist, in the tool's axes [N, Nm]. Shape (6,).
        """
        self.kinematics.update(joints_rad)
        self.tip = self.kinematics.tip
        self.wrist.update(wrench, self.tip)

    def accelerate(self, acceleration: Array, dt_s: float) -> Array:
        """Move the setpoint under an acceleration and follow it.

        Args:
            acceleration: Shape (6,) [m/s^2, rad/s^2].
            dt_s: Control period [s].

        Returns:
            Joint velocities. Shape (6,) [rad/s].
        """
        self._look()
        return self._track(acceleration, dt_s, holds=not self._presses)

    def follow(self, pose: Array, speed_m_s: float, dt_s: float) -> Array:
        """Follow a pose, critically damped.

        Args:
            pose: Shape (7,).
            speed_m_s: Speed limit [m/s]; the rotation is limited in proportion.
            dt_s: Control period [s].

        Returns:
            Joint velocities. Shape (6,) [rad/s].
        """
        self._look()
        limits, w = self._settings.limits, _FOLLOW_RAD_S
        error = difference(self.setpoint.pose, pose)
        share = min(speed_m_s / limits.speed_m_s, 1.0)
        wanted = 0.5 * w * error
        wanted[:3] = shortened(wanted[:3], share * limits.speed_m_s)
        wanted[3:] = shortened(wanted[3:], share * limits.angular_speed_rad_s)
        acceleration = 2.0 * w * (wanted + self._carried() - self.setpoint.velocity)
        return self._track(acceleration, dt_s, holds=not self._presses)

    def brake(self, dt_s: float) -> Array:
        """Brake, or hold still: in the bore relative to the receptacle, otherwise relative to the base.

        Args:
            dt_s: Control period [s].

        Returns:
            Joint velocities. Shape (6,) [rad/s].
        """
        self._look()
        return self._track((self._carried() - self.setpoint.velocity) / _BRAKE_S, dt_s, holds=True)

    @property
    def carried(self) -> Array | None:
        """Velocity of the receptacle at the setpoint, if it is near; None in free water. Shape (6,)."""
        return self._carried() if self.governor.active else None

    def _look(self) -> None:
        self.governor.look(self._seen, self.tip, self.wrist.force)

    def _carried(self) -> Array:
        """Return the velocity of the motion's reference: the receptacle if it is near. Shape (6,)."""
        if self._seen is None or not self.governor.active:
            return np.zeros(6)
        return self._seen.velocity_at(self.setpoint.pose)

    def _track(self, acceleration: Array, dt_s: float, holds: bool) -> Array:
        governor, setpoint, carried = self.governor, self.setpoint, self._carried()
        if holds and not self._held and governor.active:  # a pressed-in plug is not drawn back
            ahead_m = float((self.tip[:3] - setpoint.pose[:3]) @ governor.axis)
            setpoint.pose[:3] += max(ahead_m, 0.0) * governor.axis
        self._held = holds
        limits, error = self._settings.limits, difference(self.tip, setpoint.pose)
        twist = setpoint.accelerate(acceleration, carried, dt_s)
        twist = twist + (_GAIN_CONTACT_1_S if governor.active else _GAIN_FREE_1_S) * error
        twist += admittance(self._settings.compliance, self.wrist.smooth, self.tip)
        relative = twist - carried
        twist[:3] = carried[:3] + shortened(relative[:3], limits.speed_m_s)
        twist[3:] = carried[3:] + shortened(relative[3:], limits.angular_speed_rad_s)
        if governor.active:
            self._govern(twist, float(error[:3] @ governor.axis), carried, holds)
        setpoint.follow(self.tip)
        fastest_m_s = limits.speed_m_s + math.sqrt(carried[:3] @ carried[:3])
        self.solution = self._ik.solve(twist, fastest_m_s)
        self._velocities = ramped(self._velocities, self.solution.joint_velocities, self._accelerations, dt_s)
        return self._velocities

    def _govern(self, twist: Array, lead_m: float, carried: Array, holds: bool) -> None:
        """Limit a twist along the bore; pull back a setpoint that would run away."""
        governor, setpoint, axis = self.governor, self.setpoint, self.governor.axis
        with_it = float(carried[:3] @ axis)
        wanted = float(twist[:3] @ axis) - with_it
        if not holds:
            wanted += _GAIN_CONTACT_1_S * _overdrive_m(governor.depth_m)
        lead_m_s = float(setpoint.velocity[:3] @ axis) - with_it
        allowed = governor.speed(wanted, lead_m, lead_m_s, holds)
        if allowed < wanted:
            setpoint.pull_back(axis, lead_m - governor.LEAD_M, allowed + with_it)
        twist[:3] += (allowed - float(twist[:3] @ axis) + with_it) * axis


def _overdrive_m(depth_m: float) -> float:
    part = (depth_m - _OVERDRIVE_FROM_M) / (_OVERDRIVE_FULL_M - _OVERDRIVE_FROM_M)
    return _OVERDRIVE_M * min(max(part, 0.0), 1.0)
