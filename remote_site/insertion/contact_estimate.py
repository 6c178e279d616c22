"""Receptacle's pose from contact: forces and torques on the plug correct the frame that sight estimates.

Touch reveals the constant error of a tracker, which sight cannot. The force that pushes the plug aside and the torque
that tilts it show on which side of the estimate the bore is. Their integral moves the estimated frame to
that side, so that the arm's controller and its compliance no longer work against each other. While the receptacle
moves, the forces show that motion, so the correction pauses.

In the frame of the receptacle the mouth is the origin, and z points into the bore.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.manifold import exp_at, log_at
from farhand.common.model.task_frame import TaskFrame

Array = NDArray[np.float64]

# Gains: per newton beyond the first three, and per newton metre beyond the first 0.3.
_GAIN_M_S_N, _GAIN_RAD_S_NM = 0.005, 0.5
_LEAST_N, _LEAST_NM = 3.0, 0.3
# No faster than the arm follows, or it would oscillate deep in the bore, where contact is stiff.
_FASTEST_M_S, _FASTEST_RAD_S = 0.02, 0.1
_MOST_M, _MOST_RAD = 0.030, 0.12
# Share of the distance to a jammed plug by which the frame moves.
_BLEND = 0.7
_SIDEWAYS = np.array([1.0, 1.0, 0.0])
_NONE = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class ContactWrench:
    """Pose and wrench of the plug in one control period.

    Args:
        plug: Pose of its tip in the world. Shape (7,).
        force_n: Force on it, in the axes of the world. Shape (3,) [N].
        torque_nm: Torque on it about its tip, in the axes of the world. Shape (3,) [Nm].
    """

    plug: Array
    force_n: Array
    torque_nm: Array


class ContactCorrection:
    """Correction of the frame, starting at zero, of at most 30 mm and 0.12 rad."""

    def __init__(self) -> None:
        self.clear()

    @property
    def shift_m(self) -> Array:
        """Displacement of the frame, in its own axes. Shape (3,) [m]."""
        return self._offset[:3].copy()

    @property
    def turn_rad(self) -> Array:
        """Rotation of the frame: rotation vector in its own axes. Shape (3,) [rad]."""
        return self._offset[3:].copy()

    def clear(self) -> None:
        """Reset the correction: the receptacle is elsewhere."""
        self._offset = np.zeros(6)
        self._pose = _NONE  # pose of the corrected frame in the seen one

    def update(self, force_n: Array, torque_nm: Array, quiet: bool, dt_s: float) -> None:
        """Integrate the wrench of one control period in contact.

        Args:
            force_n: Force on the plug, in the axes of the estimated frame. Shape (3,) [N].
            torque_nm: Torque on the plug about its tip, in the same axes. Shape (3,) [Nm].
            quiet: True if the receptacle stands still.
            dt_s: Control period [s].
        """
        if not quiet:
            return
        shift_m_s = _GAIN_M_S_N * _beyond(_SIDEWAYS * force_n, _LEAST_N)
        turn_rad_s = _GAIN_RAD_S_NM * _beyond(_SIDEWAYS * torque_nm, _LEAST_NM)
        self._add(dt_s * _shortened(shift_m_s, _FASTEST_M_S), dt_s * _shortened(turn_rad_s, _FASTEST_RAD_S))

    def anchor(self, plug: Array) -> None:
        """Move the frame most of the way to a jammed plug: the bore's axis is near the plug's.

        Args:
            plug: Pose of its tip in the corrected frame. Shape (7,).
        """
        axis = TaskFrame.at(plug).A[:, 2]
        crossing = plug[:3] - axis * (
            plug[2] / axis[2]
        )  # where the plug's axis goes through the mouth's plane
        tilt = np.cross((0.0, 0.0, 1.0), axis)  # the sine of the tilt about it
        self._add(_BLEND * crossing, _BLEND * tilt)

    def push(self, by_m: float) -> None:
        """Move the frame along its axis: the bottom of the bore was not where it was believed to be [m]."""
        self._add(np.array([0.0, 0.0, by_m]), np.zeros(3))

    def corrected(self, frame: TaskFrame) -> TaskFrame:
        """Return the frame of the receptacle by sight and touch together."""
        return frame if self._pose is _NONE else TaskFrame.at(frame.to_world(self._pose))

    def _add(self, shift_m: Array, turn_rad: Array) -> None:
        """Add a displacement and a rotation, both in the axes of the corrected frame."""
        if not (shift_m.any() or turn_rad.any()):
            return
        way, moved, offset, pose = np.empty(6), np.empty(7), np.empty(6), np.empty(7)
        way[:3], way[3:] = TaskFrame.at(self._pose).A @ shift_m, turn_rad
        exp_at(self._pose, way, moved)
        log_at(_NONE, moved, offset)
        offset[:3], offset[3:] = _shortened(offset[:3], _MOST_M), _shortened(offset[3:], _MOST_RAD)
        exp_at(_NONE, offset, pose)
        self._offset, self._pose = offset, pose


def _beyond(vector: Array, least: float) -> Array:
    """Shorten a vector by a dead band."""
    length = math.sqrt(vector @ vector)
    return vector * (max(length - least, 0.0) / max(length, 1e-12))


def _shortened(vector: Array, most: float) -> Array:
    return vector * min(1.0, most / max(math.sqrt(vector @ vector), 1e-12))
