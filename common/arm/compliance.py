"""Compliance of the arm: admittance sideways and in tilt, a force governor along the bore.

Force and torque sensor of the wrist: tool weight removed, tared, and expressed about the tip.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.kinematics import Kinematics, compose, inverse, rotation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ComplianceSettings:
    """Gains and limits of the compliance.

    Args:
        lateral_m_s_n: Velocity per force across the plug's axis [m/s per N].
        tilt_rad_s_nm: Angular velocity per torque about the tip [rad/s per Nm].
        lateral_dead_n: Dead band of the force [N].
        tilt_dead_nm: Dead band of the torque [Nm].
        lateral_most_m_s: Largest velocity with which the tip yields [m/s].
        tilt_most_rad_s: Largest angular velocity with which the tool yields [rad/s].
        insertion_n: Largest force along the bore during the insertion [N].
        seated_n: Force along the bore once seated [N].
        hold_n: Largest force along the bore while the arm holds still [N].
        axial_m_s_n: Velocity per missing or excess force along the bore [m/s per N].
        pressing_m_s_n: The same gain once seated; with a larger one plug and receptacle would bounce [m/s per N].
        lifted_n: Missing force from which contact is being lost, so that the high gain applies again [N].
        seated_from_m: Least depth of a seated plug [m].
        seated_felt_n: Least force felt by a seated plug [N].
    """

    lateral_m_s_n: float = 0.001
    tilt_rad_s_nm: float = 0.1
    lateral_dead_n: float = 3.0
    tilt_dead_nm: float = 0.3
    lateral_most_m_s: float = 0.03
    tilt_most_rad_s: float = 0.2
    insertion_n: float = 60.0
    seated_n: float = 20.0
    hold_n: float = 25.0
    axial_m_s_n: float = 0.0015
    pressing_m_s_n: float = 0.0005
    lifted_n: float = 12.0
    seated_from_m: float = 0.068
    seated_felt_n: float = 25.0


class SeenReceptacle(NamedTuple):
    """Estimated pose and velocity of the receptacle.

    Args:
        pose: Shape (7,).
        velocity: A tangent at the pose [m/s, rad/s]. Shape (6,).
    """

    pose: Array
    velocity: Array

    def velocity_at(self, pose: Array) -> Array:
        """Return the velocity of a body that moves rigidly with the receptacle, as a tangent at its pose.

        Shape (6,).
        """
        turn = rotation(self.pose) @ self.velocity[3:]
        out, arm = np.empty(6), pose[:3] - self.pose[:3]
        out[0] = self.velocity[0] + turn[1] * arm[2] - turn[2] * arm[1]
        out[1] = self.velocity[1] + turn[2] * arm[0] - turn[0] * arm[2]
        out[2] = self.velocity[2] + turn[0] * arm[1] - turn[1] * arm[0]
        out[3:] = rotation(pose).T @ turn
        return out


def admittance(settings: ComplianceSettings, wrench: Array, tip: Array) -> Array:
    """Compute the twist with which the tool yields to a wrench. Shape (6,).

    Args:
        settings: Gains.
        wrench: Force and torque on the tool about its tip, in its axes [N, Nm]. Shape (6,).
        tip: Pose of the tip. Shape (7,).
    """
    out, aside = np.zeros(6), np.zeros(3)
    aside[:2] = _yielding(
        wrench[:2], settings.lateral_dead_n, settings.lateral_m_s_n, settings.lateral_most_m_s
    )
    out[:3] = rotation(tip) @ aside
    out[3:5] = _yielding(wrench[3:5], settings.tilt_dead_nm, settings.tilt_rad_s_nm, settings.tilt_most_rad_s)
    return out


def _yielding(load: Array, dead: float, gain: float, most: float) -> Array:
    size = math.sqrt(load @ load)
    return load * (min(gain * (size - dead), most) / size) if size > dead else np.zeros_like(load)


class Governor:
    """Limiter of the speed along the bore: keeps the force below its limit, and presses once seated.

    Args:
        settings: Forces and gains.
    """

    _BEFORE_M, _BESIDE_M = 0.030, 0.060
    _SLOWEST_M_S, _FASTEST_M_S = -0.10, 0.06
    _LEAVING_M, _LEAVING_M_S = -0.009, -0.02
    LEAD_M = 0.002
    """Largest lead of a setpoint over an arm that must not follow it [m]."""

    def __init__(self, settings: ComplianceSettings):
        self._settings = settings
        self.seated = False
        self.active = False
        """True while the plug is in the receptacle or close in front of it."""
        self.depth_m = -np.inf
        """Depth of the tip in the estimated receptacle [m]."""
        self.axis = np.zeros(3)
        """Inward axis of the bore, in the axes of the base. Shape (3,)."""
        self.force_n = 0.0
        """Force against the insertion [N]."""

    def look(self, seen: SeenReceptacle | None, tip: Array, force: Array) -> None:
        """Update the pose of the plug and the force on it.

        Args:
            seen: Receptacle, None while it is unknown.
            tip: Pose of the tip. Shape (7,).
            force: Force on the tool, in the axes of the base [N]. Shape (3,).
        """
        if seen is None:
            self.active = self.seated = False
            self.depth_m = -np.inf
            return
        x, y, self.depth_m = compose(inverse(seen.pose), tip)[:3].tolist()
        self.active = self.depth_m > -self._BEFORE_M and x * x + y * y < self._BESIDE_M**2
        self.axis = rotation(seen.pose)[:, 2]
        self.force_n = -float(force @ self.axis)

    def speed(self, wanted_m_s: float, lead_m: float, lead_m_s: float, holds: bool) -> float:
        """Return the speed along the bore, relative to the receptacle [m/s].

        Args:
            wanted_m_s: Speed of the commanded motion [m/s].
            lead_m: Lead of the setpoint over the tip [m].
            lead_m_s: The setpoint's own speed [m/s].
            holds: True while the arm only holds still.
        """
        settings = self._settings
        deep = self.depth_m > settings.seated_from_m
        felt = self.seated or self.force_n > settings.seated_felt_n
        leaving = lead_m < self._LEAVING_M and lead_m_s < self._LEAVING_M_S
        self.seated = self.active and deep and felt and not leaving
        limit_n = settings.seated_n if self.seated else settings.hold_n if holds else settings.insertion_n
        missing_n = limit_n - self.force_n
        most = settings.axial_m_s_n * missing_n
        if self.seated:
            gentle = settings.axial_m_s_n - settings.pressing_m_s_n
            most -= gentle * min(missing_n, settings.lifted_n)
        most = min(max(most, self._SLOWEST_M_S), self._FASTEST_M_S)
        return most if self.seated and not holds else min(wanted_m_s, most)


_GRAVITY_M_S2 = 9.81
_SMOOTHING = 0.2
"""Coefficient of the low-pass filter, per control period."""
_TARE_TICKS = 40


class Wrist:
    """Compensated force and torque sensor at the wrist.

    Args:
        kinematics: Kinematics of the arm, up to date.
    """

    def __init__(self, kinematics: Kinematics):
        self._kinematics = kinematics
        self._mass_kg, self._centre = kinematics.tool_weight()
        self._reach_m = kinematics.cell.plug.reach_m
        self.bias, self._sum = np.zeros(6), np.zeros(6)
        """Reading without contact and without the tool's weight [N, Nm]. Shape (6,)."""
        self._to_tare = 0
        self.force = np.zeros(3)
        """Measured force in the axes of the base [N]. Shape (3,)."""
        self.torque = np.zeros(3)
        """Measured torque about the tip, in the axes of the tool [Nm]. Shape (3,)."""
        self.smooth = np.zeros(6)
        """Low-passed force and torque about the tip in the axes of the tool [N, Nm]. Shape (6,)."""

    def tare(self) -> None:
        """Tare the sensor: the mean of the next 0.4 s becomes its zero.

        Nothing may touch the tool meanwhile.
        """
        self._to_tare, self._sum = _TARE_TICKS, np.zeros(6)

    def restore(self, bias: Array) -> None:
        """Restore a known zero of the sensor instead of taring it. Shape (6,)."""
        self.bias, self._to_tare = bias, 0

    def update(self, measured: Array, tip: Array) -> None:
        """Process a measurement.

        Args:
            measured: Force and torque on the tool about the wrist, in the tool's axes [N, Nm]. Shape (6,).
            tip: Pose of the tip. Shape (7,).
        """
        R = rotation(tip)
        weight = R.T @ (0.0, 0.0, -self._mass_kg * _GRAVITY_M_S2)
        wrench = measured - np.concatenate([weight, _cross(self._centre, weight)])
        if self._to_tare:
            self._sum += wrench
            self._to_tare -= 1
            if not self._to_tare:
                self.bias = self._sum / _TARE_TICKS
        wrench = wrench - self.bias
        wrench[3:] -= _cross((0.0, 0.0, self._reach_m), wrench[:3])
        self.force, self.torque = R @ wrench[:3], wrench[3:]
        self.smooth = self.smooth + _SMOOTHING * (wrench - self.smooth)


def _cross(a: Array | tuple[float, ...], b: Array) -> Array:
    """Compute a cross product; numpy's own takes twenty times as long for one pair."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
