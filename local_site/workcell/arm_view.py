"""The operator's arm at one moment, as it is shown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ArmView:
    """An arm before its receptacle. All poses from the arm's base.

    Args:
        joints_rad: Angles of the arm. Shape (6,) [rad].
        tip: Pose of the plug's tip. Shape (7,).
        receptacle: Pose of its mouth, z into the bore. Shape (7,).
        depth_m: How far the tip is behind the mouth, negative before it [m].
        lateral_m: How far it is from the bore's axis [m].
        tilt_rad: Between the axes of plug and bore [rad].
        held: Whether a hand holds the arm.
        saturated: Whether the hand wants what the arm cannot do.
        seed: Of where arm and receptacle were put; another one after each renewal.
    """

    joints_rad: Array
    tip: Array
    receptacle: Array
    depth_m: float
    lateral_m: float
    tilt_rad: float
    held: bool
    saturated: bool
    seed: int
