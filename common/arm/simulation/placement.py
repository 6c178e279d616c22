"""Start conditions of a task: the receptacle in a box, the arm near its rest or plugged in."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.dimensions import Dimensions
from farhand.common.arm.insertion_trajectory import InsertionTrajectory
from farhand.common.arm.kinematics import Kinematics
from farhand.common.arm.poses import compose
from farhand.common.arm.simulation.receptacle import FACING_QUAT
from farhand.common.model.manifold import POSE

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Box:
    """Box that contains the receptacle's mouth, from the arm's base.

    Args:
        low_m: Least coordinates. Length 3 [m].
        high_m: Largest coordinates. Length 3 [m].
        tilt_rad: Largest angle between its axis and the direction to the arm [rad].
    """

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]
    tilt_rad: float = math.radians(15.0)

    def sample(self, random: np.random.Generator) -> Array:
        """Draw a receptacle anywhere in a box, with the arm near its rest."""
        mouth = random.uniform(self.low_m, self.high_m)
        about, tilt = random.uniform(0.0, 2.0 * np.pi), random.uniform(0.0, self.tilt_rad)
        turn = tilt * np.array([np.cos(about), np.sin(about), 0.0])
        return POSE.exp(np.concatenate([mouth, FACING_QUAT]), np.concatenate([np.zeros(3), turn]))


ACCEPTANCE = Box((0.74, -0.10, 0.30), (0.82, 0.10, 0.45))
WIDE = Box((0.74, -0.15, 0.25), (0.86, 0.15, 0.50))

# First place of a seated plug: a little before the bottom, within the clearance, without contact.
_OFF_BOTTOM_M, _ASIDE_M, _TILT_RAD = (0.0005, 0.002), 0.0003, math.radians(0.15)
_JOINT_STD_RAD = np.array([0.12, 0.12, 0.12, 0.07, 0.07, 0.07])


class Placement(NamedTuple):
    """Initial state of arm and receptacle.

    Args:
        receptacle: Pose of the receptacle from the arm's base. Shape (7,).
        joints_rad: Joint angles of the arm. Shape (6,) [rad].
    """

    receptacle: Array
    joints_rad: Array

    @classmethod
    def sample(cls, random: np.random.Generator, box: Box, dimensions: Dimensions) -> Placement:
        """Draw a receptacle anywhere in a box, with the arm near its rest."""
        receptacle = box.sample(random)
        return cls(receptacle, np.array(dimensions.home_rad) + random.normal(size=6) * _JOINT_STD_RAD)

    @classmethod
    def seated(cls, random: np.random.Generator, box: Box, dimensions: Dimensions) -> Placement:
        """Draw a receptacle anywhere in a box, with the plug seated in it."""
        receptacle, joints_rad = cls.sample(random, box, dimensions)
        way_in = InsertionTrajectory(Kinematics(dimensions))
        for _ in way_in.go(joints_rad, receptacle):
            pass
        aside, tilt = random.uniform(-_ASIDE_M, _ASIDE_M, 2), random.uniform(-_TILT_RAD, _TILT_RAD, 2)
        depth_m = dimensions.receptacle.depth_m - random.uniform(*_OFF_BOTTOM_M)
        seat = POSE.exp(
            np.array([*aside, depth_m, 1.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, *tilt, 0.0])
        )
        way_in.reach(compose(receptacle, seat))
        return cls(receptacle, way_in.kinematics.joints_rad)
