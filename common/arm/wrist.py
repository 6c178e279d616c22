"""Force and torque sensor of the wrist: tool weight removed, tared, and expressed about the tip."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.kinematics import Kinematics
from farhand.common.arm.poses import rotation

Array = NDArray[np.float64]

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
        self._reach_m = kinematics.dimensions.plug.reach_m
        self.bias, self._sum = np.zeros(6), np.zeros(6)
        """What is measured when nothing is touched, without the tool's weight [N, Nm]. Shape (6,)."""
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
