"""What contact says about where the receptacle really is: a correction of its estimated frame.

A tracker's constant error can be felt but not seen. The force that pushes the plug aside, and the torque that
tilts it, say on which side of the estimate the bore is; integrated, they move the estimated frame there, so
that the controller and the compliance of the arm no longer work against each other. On a receptacle that
moves they say how it moves instead: then the correction rests.

In the frame of the receptacle the mouth is the origin, and z points into the bore.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.manifold import exp_at, log_at
from farhand.common.model.task_frame import TaskFrame

Array = NDArray[np.float64]

# Per newton beyond the first three, and per newton metre beyond the first 0.3.
_GAIN_M_S_N, _GAIN_RAD_S_NM = 0.005, 0.5
_LEAST_N, _LEAST_NM = 3.0, 0.3
# Not faster than the arm follows: deep in the bore, where contact is stiff, it would swing.
_FASTEST_M_S, _FASTEST_RAD_S = 0.02, 0.1
_MOST_M, _MOST_RAD = 0.030, 0.12
# How much of the way to a jammed plug the frame is moved.
_BLEND = 0.7
_SIDEWAYS = np.array([1.0, 1.0, 0.0])
_NONE = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


class ContactCorrection:
    """The correction, from none at first; never more than 30 mm and 0.12 rad."""

    def __init__(self) -> None:
        self.clear()

    @property
    def shift_m(self) -> Array:
        """How far the frame is moved, in its own axes. Shape (3,) [m]."""
        return self._offset[:3].copy()

    @property
    def turn_rad(self) -> Array:
        """How far the frame is turned: rotation vector in its own axes. Shape (3,) [rad]."""
        return self._offset[3:].copy()

    def clear(self) -> None:
        """Forget what was felt: the receptacle is elsewhere."""
        self._offset = np.zeros(6)
        self._pose = _NONE  # of the corrected frame in the one seen

    def feel(self, force_n: Array, torque_nm: Array, quiet: bool, dt_s: float) -> None:
        """Take one control period in contact into account.

        Args:
            force_n: On the plug, in the axes of the estimated frame. Shape (3,) [N].
            torque_nm: On the plug about its tip, in the same axes. Shape (3,) [Nm].
            quiet: Whether the receptacle stands still.
            dt_s: Control period [s].
        """
        if not quiet:
            return
        shift_m_s = _GAIN_M_S_N * _beyond(_SIDEWAYS * force_n, _LEAST_N)
        turn_rad_s = _GAIN_RAD_S_NM * _beyond(_SIDEWAYS * torque_nm, _LEAST_NM)
        self._add(dt_s * _shortened(shift_m_s, _FASTEST_M_S), dt_s * _shortened(turn_rad_s, _FASTEST_RAD_S))

    def anchor(self, plug: Array) -> None:
        """Most of the way to where a plug is jammed: the bore's axis is near that of the plug.

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
        """Move the frame along its axis: the bottom of the bore was felt elsewhere than it was believed [m]."""
        self._add(np.array([0.0, 0.0, by_m]), np.zeros(3))

    def corrected(self, frame: TaskFrame) -> TaskFrame:
        """Where the receptacle is, as seen and felt."""
        return frame if self._pose is _NONE else TaskFrame.at(frame.to_world(self._pose))

    def _add(self, shift_m: Array, turn_rad: Array) -> None:
        """Move on, by a way in the axes of the corrected frame."""
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
    """What is left of a vector's length beyond a dead band."""
    length = math.sqrt(vector @ vector)
    return vector * (max(length - least, 0.0) / max(length, 1e-12))


def _shortened(vector: Array, most: float) -> Array:
    return vector * min(1.0, most / max(math.sqrt(vector @ vector), 1e-12))
