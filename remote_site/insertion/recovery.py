"""Recovery of an insertion: the decision when a jammed or misplaced plug retreats, and to which pose.

The model continues from that pose. A plug to be extracted cannot retreat, but it is in the bore, so its pose
reveals that of the bore. In the frame of the receptacle the mouth is the origin, and z points into
the bore.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.insertion.contact_estimate import ContactCorrection
from farhand.remote_site.insertion.detectors import JamDetector, MissedMouthDetector, Stuck

Array = NDArray[np.float64]

MAX_ATTEMPTS = 4
_JAM_BACK_M = 0.030
_IN_BORE_M = 0.030  # depth behind the mouth, and largest distance from the axis: more than the error of sight
_REACHED_M, _PATIENCE_S = 0.004, 4.0
# Accuracy of the estimate right after a jump.
_ALIGNED_M = 0.015


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
