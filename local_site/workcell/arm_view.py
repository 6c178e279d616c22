"""Snapshot of the operator's arm for display."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import ArmTask
from farhand.local_site.teaching.goal import goal_miss

Array = NDArray[np.float64]

_SEATED_M, _OUT_M = 0.010, 0.100
"""Largest distance of a seated plug from the bottom of the bore, and least distance of an extracted one from the mouth [m]."""


@dataclass(frozen=True, eq=False)
class ArmView:
    """Arm in front of its receptacle. All poses are relative to the arm's base.

    Args:
        joints_rad: Angles of the arm. Shape (N,) [rad].
        tip: Pose of the plug's tip. Shape (7,).
        receptacle: Pose of its mouth, z into the bore. Shape (7,).
        depth_m: Depth of the tip behind the mouth, negative in front of it [m].
        lateral_m: Distance of the tip from the bore's axis [m].
        tilt_rad: Angle between the axes of plug and bore [rad].
        held: True while a hand holds the arm.
        saturated: True while the arm cannot do what the hand wants.
        still: True while the arm stands still.
        seed: Seed of the placement of arm and receptacle; changes with each reset.
        bore_m: Depth of the bore [m].
    """

    joints_rad: Array
    tip: Array
    receptacle: Array
    depth_m: float
    lateral_m: float
    tilt_rad: float
    held: bool
    saturated: bool
    still: bool
    seed: int
    bore_m: float

    def is_at_goal(self, task: ArmTask) -> bool:
        """Decide whether the plug stands still at the end of a task: in its seat, or well before the mouth."""
        end = self.bore_m - self.depth_m <= _SEATED_M if task.skill == "insert" else -self.depth_m >= _OUT_M
        return self.still and end and not goal_miss(task, TaskFrame.at(self.receptacle).to_local(self.tip))
