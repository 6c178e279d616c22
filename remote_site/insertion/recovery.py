"""When and where to an insertion goes back, to try again: jammed, or beside the mouth after a jump.

It goes on with the model by itself, from where it went back to. A plug that is to come out has nowhere to go
back to; but it is in the bore, which therefore is where the plug is. In the frame of the receptacle the mouth is
the origin, and z points into the bore.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.insertion.beside import BesideRule
from farhand.remote_site.insertion.contact_correction import ContactCorrection
from farhand.remote_site.insertion.jam import JamDetector, Stuck

Array = NDArray[np.float64]

MAX_ATTEMPTS = 4
_JAM_BACK_M = 0.030
_IN_BORE_M = 0.030  # behind the mouth, and at most so far beside the axis: more than sight is wrong by
_REACHED_M, _PATIENCE_S = 0.004, 4.0
# The estimate of a receptacle that has just jumped is no better.
_ALIGNED_M = 0.015


@dataclass(frozen=True, eq=False)
class Felt:
    """What is known of the plug in one control period.

    Args:
        plug: Pose of its tip in the world. Shape (7,).
        force_n: On it, in the axes of the world. Shape (3,) [N].
        torque_nm: On it about its tip, in the axes of the world. Shape (3,) [Nm].
    """

    plug: Array
    force_n: Array
    torque_nm: Array


class Recovery:
    """Corrects the frame of the receptacle, and says when to go back and where to.

    Args:
        correcting: Whether contact corrects the frame.
        attempts: How often it may go back from a jam; with none it presses on.
        depth_m: Of the bore [m].
        enters: Whether the plug is to go into the bore, and not to come out of it.
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
        """Whether the plug is to go into the bore, and not to come out of it."""
        self.correction = ContactCorrection()
        self._jam, self._beside = JamDetector(), BesideRule()
        self._goal: Array | None = None  # in the frame of the receptacle
        self._until_s, self._reached_m = 0.0, _REACHED_M
        self.jams = 0
        """How often it was jammed."""
        self.retreats = 0
        """How often it was beside the mouth."""

    @property
    def given_up(self) -> bool:
        """Whether it was jammed once more than it may go back."""
        return 0 < self._attempts < self.jams

    def begin(self, plug: Array, seen: TaskFrame) -> None:
        """The motion begins: where a plug is that is to come out, there the bore is.

        Args:
            plug: Pose of its tip in the world. Shape (7,).
            seen: The frame of the receptacle, as seen.
        """
        local = self.correction.corrected(seen).to_local(plug)
        in_bore = local[2] > _IN_BORE_M and np.hypot(local[0], local[1]) < _IN_BORE_M
        if self._correcting and in_bore and not self.enters:
            self.correction.anchor(local)

    def jumped(self) -> None:
        """The receptacle was found elsewhere: what was felt does not hold there."""
        self.correction.clear()
        self._beside.jumped()

    def corrected(self, frames: Sequence[TaskFrame]) -> list[TaskFrame]:
        """The task frames as seen and felt; the first is that of the receptacle."""
        return [self.correction.corrected(frames[0]), *frames[1:]]

    def update(self, felt: Felt, seen: TaskFrame, quiet: bool, now_s: float, dt_s: float) -> Array | None:
        """One control period.

        Args:
            felt: What is known of the plug.
            seen: The frame of the receptacle, as seen.
            quiet: Whether the receptacle stands still.
            now_s: Now [s].
            dt_s: Control period [s].

        Returns:
            The pose in the world to go back to; None when the motion may go on. Shape (7,).
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
                frame = self.correction.corrected(seen)  # it may have been moved
                self._goal, self._until_s = frame.to_local(back), now_s + _PATIENCE_S
        if self._goal is not None:
            return frame.to_world(self._goal)
        if self._correcting and self.enters:
            self.correction.feel(frame.A.T @ felt.force_n, frame.A.T @ felt.torque_nm, quiet, dt_s)
        return None

    def _back(self, local: Array, force_n: Array, torque_nm: Array, now_s: float) -> Array | None:
        """Where to go back to from a pose, if that begins now; in the frame of the receptacle until now."""
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
