"""Sight and touch of a receptacle, together: where it is believed to be, and where an execution must go back to.

What it needs of an arm is more than a `Plant` has: the torque on the tool, and that it is told where the
receptacle is. The first task frame is that of the receptacle: its origin in the mouth, z into the bore.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from common.robot.compliance import SeenReceptacle
from common.task_frame import TaskFrame
from remote_site.insertion import Arm
from remote_site.perception import SimulatedPerception
from remote_site.plant import EffectorState
from remote_site.recovery import Felt, Recovery
from remote_site.sensing import Sensing

Array = NDArray[np.float64]


class Touch:
    """Tells the arm where its receptacle is, in every control period.

    Args:
        arm: The machine.
        perception: Sight of the receptacle.
        recovery: Its way out of jams, with what was felt.
    """

    def __init__(self, arm: Arm, perception: SimulatedPerception, recovery: Recovery):
        self._arm, self._perception = arm, perception
        self.recovery = recovery
        self.jumps = 0
        """How often the receptacle was found elsewhere."""

    def update(self, sensing: Sensing, executing: bool, now_s: float, dt_s: float) -> Array | None:
        """Take what was sensed just now into account.

        Args:
            sensing: The newest measurements; it is told where the receptacle is believed to be.
            executing: Whether a model moves the arm; else nothing is learned of contact.
            now_s: Now [s].
            dt_s: Control period [s].

        Returns:
            The pose to go back to before the execution goes on; None when it may. Shape (7,).
        """
        newest, back = self._perception.newest, None
        if newest is not None and newest.jumps > self.jumps:
            self.jumps = newest.jumps
            self.recovery.jumped()
        if executing:
            quiet = newest is not None and newest.quiet
            back = self.recovery.update(_felt(sensing.effector), sensing.seen[0], quiet, now_s, dt_s)
        sensing.believe(self.recovery.corrected(sensing.seen))
        if math.isfinite(sensing.unseen_s):
            velocity = np.zeros(6) if newest is None else newest.velocity
            self._arm.see(SeenReceptacle(pose_of(sensing.frames[0]), velocity))
        return back


def pose_of(frame: TaskFrame) -> Array:
    """A frame as a pose. Shape (7,)."""
    return np.concatenate([frame.b, frame.quat_wxyz])


def _felt(effector: EffectorState) -> Felt:
    load = np.zeros(6) if effector.load is None else effector.load
    return Felt(effector.point, load[:3], TaskFrame.at(effector.point).A @ load[3:])
