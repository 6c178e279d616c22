"""Jams and retries of an insertion: a jammed plug, and one that missed the mouth, retreat and try again.

Deep in the bore a plug stops for one of two reasons. A force or torque across the axis means that it jammed;
a force along the axis alone means that it reached the bottom, and that the receptacle is nearer than
believed.

Without a detector the motion would continue and push the receptacle from the side, or restart its approach
from far away, which takes longer than the rest of the insertion. So a plug at or behind the mouth retreats straight back,
a plug in front of the mouth moves onto the axis, and there the motion resumes. An error of the estimate along
the axis looks like a plug beside the mouth; therefore the detector waits until the receptacle has jumped or
the plug has lost the axis.

A plug to be extracted cannot retreat, but it is in the bore, so its pose reveals that of the bore. In the frame of
the receptacle the mouth is the origin, and z points into the bore.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.insertion.contact_estimate import ContactCorrection, ContactWrench

Array = NDArray[np.float64]

# No progress: less than this distance within this time, under more than this force.
_PROGRESS_M, _WITHIN_S, _FORCE_N = 0.0015, 1.0, 15.0
# Believed depths between which a plug can jam, and the least depth at which it can have reached the bottom.
_FROM_M, _TO_M, _BOTTOM_M = -0.020, 0.070, 0.045
# Pressed straight: less force and torque across the axis than this.
_STRAIGHT_N, _STRAIGHT_NM = 6.0, 0.6


class Stuck(Enum):
    """Cause that stops a plug."""

    NO = auto()
    JAMMED = auto()
    AT_BOTTOM = auto()


class JamDetector:
    """Detector of jams from depth, force and torque."""

    def __init__(self) -> None:
        self._depths_m: deque[tuple[float, float]] = deque()

    def stuck(
        self, depth_m: float, force_n: NDArray[np.float64], torque_nm: NDArray[np.float64], now_s: float
    ) -> Stuck:
        """Return the cause that has stopped the plug for a second, NO while it moves on; after a cause the second starts again.

        Args:
            depth_m: Believed depth of the tip behind the mouth [m].
            force_n: Force on the plug, in the axes of the receptacle. Shape (3,) [N].
            torque_nm: Torque on the plug about its tip, in the same axes. Shape (3,) [Nm].
            now_s: Present time [s].
        """
        if not _FROM_M < depth_m < _TO_M or float(np.linalg.norm(force_n)) < _FORCE_N:
            self._depths_m.clear()
            return Stuck.NO
        self._depths_m.append((now_s, depth_m))
        if now_s - self._depths_m[0][0] < _WITHIN_S:
            return Stuck.NO
        _, before_m = self._depths_m.popleft()
        if depth_m - before_m >= _PROGRESS_M:
            return Stuck.NO
        self._depths_m.clear()
        straight = np.hypot(*force_n[:2]) < _STRAIGHT_N and np.hypot(*torque_nm[:2]) < _STRAIGHT_NM
        return Stuck.AT_BOTTOM if straight and depth_m > _BOTTOM_M else Stuck.JAMMED


# Hysteresis: on the axis within the first distance, off it beyond the second, which exceeds the noise of sight.
_ON_AXIS_M, _OFF_AXIS_M = 0.020, 0.030
_BEHIND_M = -0.020
# Inside the mouth, within its chamfer, the plug has caught up with the jump.
_INSIDE_M = 0.005
_STANDOFF_M = -0.090
# Farther away, the approach has not begun yet.
_NEAR_M = -0.150


class MissedMouthDetector:
    """Detector of a plug beside the mouth; armed when the axis is lost, until the plug is in the bore."""

    def __init__(self) -> None:
        self._on_axis = self._armed = self._off_axis = False

    def jumped(self) -> None:
        """Note that the receptacle was found at another place."""
        self._armed = self._off_axis = True

    def goal_m(self, tip_m: Array) -> Array | None:
        """Return the next point on the way back to the axis, or None if the motion may continue. Shape (3,) [m].

        Args:
            tip_m: Position of the plug's tip in the frame of the receptacle, whose z axis points into the
                bore. Shape (3,) [m].
        """
        x, y, z = tip_m.tolist()
        lateral_m = float(np.hypot(x, y))
        if self._on_axis and lateral_m > _OFF_AXIS_M:
            self.jumped()
        self._on_axis = z > _NEAR_M and lateral_m < (_OFF_AXIS_M if self._on_axis else _ON_AXIS_M)
        if z > 0.0 and lateral_m < _INSIDE_M:
            self._armed = self._off_axis = False
        if not self._armed or lateral_m <= _ON_AXIS_M:
            return None
        if z > _BEHIND_M:
            self._off_axis = True
            return np.array([x, y, _STANDOFF_M])
        if not self._off_axis or z < _NEAR_M:
            return None
        self._off_axis = False
        return np.array([0.0, 0.0, min(z, _STANDOFF_M)])


MAX_ATTEMPTS = 4
_JAM_BACK_M = 0.030
_IN_BORE_M = 0.030  # depth behind the mouth, and largest distance from the axis: more than the error of sight
_REACHED_M, _PATIENCE_S = 0.004, 4.0
# Accuracy of the estimate right after a jump.
_ALIGNED_M = 0.015


class Recovery:
    """Correction of the receptacle's frame, and decision when and where to retreat.

    Args:
        correcting: True if contact corrects the frame.
        attempts: Largest number of retreats from jams; with 0 the plug keeps pressing.
        depth_m: Depth of the bore [m].
        enters: True for a plug that enters the bore, False for one that is extracted.
    """

    def __init__(
        self,
        correcting: bool = True,
        attempts: int = MAX_ATTEMPTS,
        depth_m: float = 0.085,
        enters: bool = True,
    ):
        self._correcting, self._attempts, self._depth_m = correcting, attempts, depth_m
        self.enters = enters
        """True for a plug that enters the bore, False for one that is extracted."""
        self.correction = ContactCorrection()
        self._jam, self._beside = JamDetector(), MissedMouthDetector()
        self._goal: Array | None = None  # pose in the frame of the receptacle
        self._until_s, self._reached_m = 0.0, _REACHED_M
        self.jams = 0
        """Number of jams."""
        self.retreats = 0
        """Number of retreats from beside the mouth."""

    @property
    def given_up(self) -> bool:
        """True once the number of jams exceeds the allowed retreats."""
        return 0 < self._attempts < self.jams

    def begin(self, plug: Array, seen: TaskFrame) -> None:
        """Begin the motion; the pose of a plug to be extracted corrects that of the bore.

        Args:
            plug: Pose of its tip in the world. Shape (7,).
            seen: The frame of the receptacle, as seen.
        """
        local = self.correction.corrected(seen).to_local(plug)
        in_bore = local[2] > _IN_BORE_M and np.hypot(local[0], local[1]) < _IN_BORE_M
        if self._correcting and in_bore and not self.enters:
            self.correction.anchor(local)

    def jumped(self) -> None:
        """Reset the correction, because the receptacle was found at another place."""
        self.correction.clear()
        self._beside.jumped()

    def corrected(self, frames: Sequence[TaskFrame]) -> list[TaskFrame]:
        """Return the task frames by sight and touch; the last is the receptacle's."""
        return [*frames[:-1], self.correction.corrected(frames[-1])]

    def update(
        self, felt: ContactWrench, seen: TaskFrame, quiet: bool, now_s: float, dt_s: float
    ) -> Array | None:
        """Process one control period.

        Args:
            felt: Pose and wrench of the plug.
            seen: The receptacle's frame by sight.
            quiet: True if the receptacle stands still.
            now_s: Present time [s].
            dt_s: Control period [s].

        Returns:
            The pose in the world to retreat to, or None if the motion may continue. Shape (7,).
        """
        frame = self.correction.corrected(seen)
        local = frame.to_local(felt.plug)
        if self._goal is not None:
            near = float(np.linalg.norm(local[:3] - self._goal[:3])) < self._reached_m
            if near or now_s > self._until_s:
                self._goal = None
        if self._goal is None and self.enters:
            back = self._back(local, frame.A.T @ felt.force_n, frame.A.T @ felt.torque_nm, now_s)
            if back is not None:
                back = frame.to_world(back)
                frame = self.correction.corrected(seen)  # its bottom may have been moved
                self._goal, self._until_s = frame.to_local(back), now_s + _PATIENCE_S
        if self._goal is not None:
            return frame.to_world(self._goal)
        if self._correcting and self.enters:
            self.correction.update(frame.A.T @ felt.force_n, frame.A.T @ felt.torque_nm, quiet, dt_s)
        return None

    def _back(self, local: Array, force_n: Array, torque_nm: Array, now_s: float) -> Array | None:
        """Return the goal of a retreat that begins now, in the receptacle's present frame; None for no retreat."""
        beside_m = self._beside.goal_m(local[:3])
        if beside_m is not None:
            self.retreats += 1
            self.correction.clear()
            self._reached_m = _ALIGNED_M
            return np.concatenate([beside_m, local[3:]])
        stuck = self._jam.stuck(local[2], force_n, torque_nm, now_s)
        if stuck is Stuck.AT_BOTTOM and self._correcting:
            self.correction.push(local[2] - self._depth_m)
        if stuck is not Stuck.JAMMED or self._attempts == 0:
            return None
        self.jams += 1
        if self.given_up:
            return None
        if self._correcting:
            self.correction.anchor(local)
        self._reached_m = _REACHED_M
        return np.concatenate([local[:3] - _JAM_BACK_M * TaskFrame.at(local).A[:, 2], local[3:]])
