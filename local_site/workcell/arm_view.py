"""Snapshot of the operator's arm for display."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
