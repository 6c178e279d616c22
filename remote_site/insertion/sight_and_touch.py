"""Estimate of a receptacle by sight and touch together, with the pose to retreat to.

The arm must offer more than `Plant`: the torque on the tool, and a method that receives the estimated receptacle. The first task frame is the receptacle's: origin in the mouth, z into the bore.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.compliance import SeenReceptacle
from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.insertion.contact_estimate import ContactWrench
from farhand.remote_site.insertion.jams_and_retries import Recovery
from farhand.remote_site.interface.plant import EffectorState, Plant
from farhand.remote_site.interface.sensing import Perception, Sensing
from farhand.remote_site.perception.target_filter import Estimate

Array = NDArray[np.float64]

BACK_M_S = 0.08
"""Speed of a retreat [m/s]."""


class InsertionArm(Plant, Protocol):
    """Interface of an inserting arm: its points are poses of a plug's tip, and it holds an estimate of its receptacle."""

    @property
    def near(self) -> bool:
        """True while the plug is in its receptacle or close in front of it."""
        ...

    @property
    def seated(self) -> bool:
        """True while the arm presses the plug against the bottom."""
        ...

    def tare(self) -> None:
        """Tare the wrist's force and torque sensor."""
        ...

    def set_receptacle(self, receptacle: SeenReceptacle | None, presses: bool = True) -> None:
        """Set the estimated receptacle, and whether to press the plug into it: see `Servo.set_receptacle`."""
        ...


class TrackedPerception(Perception, Protocol):
    """Perception that also estimates the target's velocity, with a covariance."""

    @property
    def newest(self) -> Estimate | None:
        """Estimate at the last look; None while the target is unseen."""
        ...


class ReceptacleEstimate(NamedTuple):
    """Joint result of sight and touch.

    Args:
        frames: The task frames.
        back: Pose to retreat to before the execution continues; None if it may continue. Shape (7,).
        receptacle: Estimate of the receptacle to pass to the arm; None for no change.
        presses: True to press the plug into the receptacle.
    """

    frames: list[TaskFrame]
    back: Array | None
    receptacle: SeenReceptacle | None
    presses: bool


class ReceptacleEstimator:
    """Estimator of the receptacle; it returns its result as a value and changes nothing else.

    Args:
        perception: Sight of the receptacle.
        recovery: Retreats from jams, with the frame's correction by contact.
        look_s: Time after the first update in which no estimate is passed to the arm, because the first ones
            are noisy [s].
    """

    def __init__(self, perception: TrackedPerception, recovery: Recovery, look_s: float):
        self._perception, self._look_s = perception, look_s
        self._tell_from_s: float | None = None
        self.jumps = 0
        """Number of jumps of the receptacle."""
        self.begin(recovery)

    def begin(self, recovery: Recovery) -> None:
        """Begin another execution."""
        self.recovery, self._begun = recovery, False

    def update(self, sensing: Sensing, executing: bool, now_s: float, dt_s: float) -> ReceptacleEstimate:
        """Process one control period's measurements.

        Args:
            sensing: The newest measurements.
            executing: True while a model moves the arm; otherwise contact is not used.
            now_s: Present time [s].
            dt_s: Control period [s].
        """
        newest = self._perception.newest
        if newest is not None and newest.jumps > self.jumps:
            self.jumps = newest.jumps
            self.recovery.jumped()
        quiet = newest is not None and newest.quiet
        back = self._feel(sensing, quiet, now_s, dt_s) if executing else None
        frames = self.recovery.corrected(sensing.seen)
        receptacle: SeenReceptacle | None = None
        if self._tell_from_s is None:
            self._tell_from_s = now_s + self._look_s
        if math.isfinite(sensing.unseen_s) and now_s >= self._tell_from_s:
            # The noise of an estimated velocity must not move an arm that holds still.
            moves = newest is not None and (executing or not quiet)
            velocity = newest.velocity if newest is not None and moves else np.zeros(6)
            receptacle = SeenReceptacle(pose_of(frames[-1]), velocity)
        return ReceptacleEstimate(frames, back, receptacle, executing and self.recovery.enters)

    def _feel(self, sensing: Sensing, quiet: bool, now_s: float, dt_s: float) -> Array | None:
        felt, frame = _felt(sensing.effector), sensing.seen[-1]
        if self._begun:
            return self.recovery.update(felt, frame, quiet, now_s, dt_s)
        self._begun = True
        self.recovery.begin(felt.plug, frame)


def pose_of(frame: TaskFrame) -> Array:
    """Return a frame as a pose. Shape (7,)."""
    return np.concatenate([frame.b, frame.quat_wxyz])


def _felt(effector: EffectorState) -> ContactWrench:
    load = np.zeros(6) if effector.load is None else effector.load
    return ContactWrench(effector.point, load[:3], TaskFrame.at(effector.point).A @ load[3:])
