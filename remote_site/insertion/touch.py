"""Sight and touch of a receptacle, together: where it is believed to be, and where an execution must go back to.

What it needs of an arm is more than a `Plant` has: the torque on the tool, and that it is told where the
receptacle is. The first task frame is that of the receptacle: its origin in the mouth, z into the bore.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.compliance import SeenReceptacle
from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.insertion.recovery import Felt, Recovery
from farhand.remote_site.interface.perception import Perception
from farhand.remote_site.interface.plant import EffectorState, Plant
from farhand.remote_site.perception.sensing import Sensing
from farhand.remote_site.perception.target_filter import Estimate

Array = NDArray[np.float64]

BACK_M_S = 0.08
"""How fast an execution goes back [m/s]."""


class InsertionArm(Plant, Protocol):
    """What the insertion needs of an arm: a plant whose points are poses of a plug's tip, and that knows its receptacle."""

    @property
    def near(self) -> bool:
        """Whether the plug is in its receptacle or close before it."""
        ...

    @property
    def seated(self) -> bool:
        """Whether the arm presses the plug to the bottom."""
        ...

    def tare(self) -> None:
        """Take what the wrist's sensor measures now for nothing."""
        ...

    def see(self, receptacle: SeenReceptacle | None, presses: bool = True) -> None:
        """Where the receptacle is believed to be, and whether the plug is to be pressed into it: `Servo.see`."""
        ...


class TrackedPerception(Perception, Protocol):
    """Sight that knows how its target moves, and how well that is known."""

    @property
    def newest(self) -> Estimate | None:
        """The estimate at the last look; None while unseen."""
        ...


class Touched(NamedTuple):
    """What sight and touch say together.

    Args:
        frames: The task frames.
        back: The pose to go back to before the execution goes on; None when it may. Shape (7,).
        receptacle: Where the arm is to believe its receptacle; None for nothing new.
        presses: Whether the plug is to be pressed into it.
    """

    frames: list[TaskFrame]
    back: Array | None
    receptacle: SeenReceptacle | None
    presses: bool


class Touch:
    """Finds in every control period where the receptacle is; tells nobody.

    Args:
        perception: Sight of the receptacle.
        recovery: Its way out of jams, with what was felt.
        look_s: For so long from the first update on the arm is told nothing: the first estimates jump about [s].
    """

    def __init__(self, perception: TrackedPerception, recovery: Recovery, look_s: float):
        self._perception, self._look_s = perception, look_s
        self._tell_from_s: float | None = None
        self.jumps = 0
        """How often the receptacle was found elsewhere."""
        self.renew(recovery)

    def renew(self, recovery: Recovery) -> None:
        """Another execution begins."""
        self.recovery, self._begun = recovery, False

    def update(self, sensing: Sensing, executing: bool, now_s: float, dt_s: float) -> Touched:
        """Take what was sensed just now into account.

        Args:
            sensing: The newest measurements.
            executing: Whether a model moves the arm; else contact tells nothing new.
            now_s: Now [s].
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
            # An arm that holds still must not wander with the noise of a velocity that is none.
            moves = newest is not None and (executing or not quiet)
            velocity = newest.velocity if newest is not None and moves else np.zeros(6)
            receptacle = SeenReceptacle(pose_of(frames[0]), velocity)
        return Touched(frames, back, receptacle, executing and self.recovery.enters)

    def _feel(self, sensing: Sensing, quiet: bool, now_s: float, dt_s: float) -> Array | None:
        felt, frame = _felt(sensing.effector), sensing.seen[0]
        if self._begun:
            return self.recovery.update(felt, frame, quiet, now_s, dt_s)
        self._begun = True
        self.recovery.begin(felt.plug, frame)


def pose_of(frame: TaskFrame) -> Array:
    """A frame as a pose. Shape (7,)."""
    return np.concatenate([frame.b, frame.quat_wxyz])


def _felt(effector: EffectorState) -> Felt:
    load = np.zeros(6) if effector.load is None else effector.load
    return Felt(effector.point, load[:3], TaskFrame.at(effector.point).A @ load[3:])
