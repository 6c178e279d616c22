"""Starts and goals of the arm's tasks: first poses of receptacle and arm, and success by the simulation's true poses."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.cell import Cell
from farhand.common.arm.kinematics import Kinematics, compose
from farhand.common.arm.preflight import InsertionTrajectory
from farhand.common.arm.robot_file import RobotFile
from farhand.common.arm.simulation.receptacle import FACING_QUAT
from farhand.common.arm.simulation.simulation import TICK_S, Simulation
from farhand.common.model.manifold import POSE

Array = NDArray[np.float64]

DEPTH_M, LATERAL_M = (0.075, 0.095), 0.004

MAX_DRAGGED_M = 0.005
"""Largest distance by which a receptacle may be dragged from its rest [m]."""
STANDOFF_M, AWAY_M = 0.12, 0.015
"""Stand-off of an extracted plug before the mouth, and largest distance from that point [m]."""
AT_REST_M_S, REST_S, TOUCHED_N = 0.015, 0.5, 5.0
"""Limits of a plug at rest: mean speed [m/s], over a time [s], and force without contact [N]. The noise of the tracker
alone moves it with 10 mm/s."""


class Goal(Protocol):
    """Goal of a trial, checked in each control period."""

    enters: bool
    """True for a plug that enters the bore, False for one that is extracted."""

    def reached(self, local: Array, force_n: float, simulation: Simulation) -> bool:
        """Decide whether the goal is reached in this control period.

        Args:
            local: Pose of the tip in the true frame of the receptacle. Shape (7,).
            force_n: Force on the tool, tared [N].
            simulation: Source of the true poses.
        """
        ...


class Seated:
    """Goal of an insertion: deep enough, not through the bottom, and on the axis."""

    enters = True

    def reached(self, local: Array, force_n: float, simulation: Simulation) -> bool:
        """Decide whether the goal is reached in this control period."""
        deep = DEPTH_M[0] <= float(local[2]) <= DEPTH_M[1]
        return deep and math.hypot(local[0], local[1]) < LATERAL_M


class Withdrawn:
    """Goal of an extraction: at rest at the stand-off, without contact, the receptacle never dragged along.

    Args:
        away_m: Largest distance from the stand-off [m].
        at_rest_m_s: Largest speed relative to the receptacle [m/s].
    """

    enters = False

    def __init__(self, away_m: float = AWAY_M, at_rest_m_s: float = AT_REST_M_S):
        self._away_m, self._at_rest_m_s = away_m, at_rest_m_s
        self.dragged_m = 0.0
        """Largest distance that the receptacle was dragged from its rest [m]."""
        self.out_s = math.nan
        """Time when the tip left the mouth [s]."""
        self._way = deque[Array](maxlen=round(REST_S / TICK_S) + 1)

    def reached(self, local: Array, force_n: float, simulation: Simulation) -> bool:
        """Decide whether the goal is reached in this control period."""
        self.dragged_m = max(self.dragged_m, simulation.deflection_m)
        self._way.append(local[:3])
        if math.isnan(self.out_s) and local[2] < 0.0:
            self.out_s = simulation.time_s
        speed_m_s = float(np.linalg.norm(local[:3] - self._way[0])) / REST_S
        away_m = math.hypot(local[0], local[1], local[2] + STANDOFF_M)
        near, at_rest = away_m <= self._away_m, speed_m_s <= self._at_rest_m_s
        return near and at_rest and force_n <= TOUCHED_N and self.dragged_m <= MAX_DRAGGED_M


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

    @classmethod
    def of(cls, robot: RobotFile) -> Box:
        """Return the workplace of a robot."""
        place = robot.workplace
        return cls(place.low_m, place.high_m, math.radians(place.tilt_deg))

    def widened(self) -> Box:
        """Return a box that extends 4 cm further away, and 5 cm to each side, up and down."""
        low = np.subtract(self.low_m, (0.0, 0.05, 0.05))
        high = np.add(self.high_m, (0.04, 0.05, 0.05))
        return replace(self, low_m=tuple(low.round(9).tolist()), high_m=tuple(high.round(9).tolist()))

    def sample(self, random: np.random.Generator) -> Array:
        """Draw a receptacle anywhere in a box, with the arm near its rest."""
        mouth = random.uniform(self.low_m, self.high_m)
        about, tilt = random.uniform(0.0, 2.0 * np.pi), random.uniform(0.0, self.tilt_rad)
        turn = tilt * np.array([np.cos(about), np.sin(about), 0.0])
        return POSE.exp(np.concatenate([mouth, FACING_QUAT]), np.concatenate([np.zeros(3), turn]))


# First place of a seated plug: a little before the bottom, within the clearance, without contact.
_OFF_BOTTOM_M, _ASIDE_M, _TILT_RAD = (0.0005, 0.002), 0.0003, math.radians(0.15)


class Placement(NamedTuple):
    """Initial state of arm and receptacle.

    Args:
        receptacle: Pose of the receptacle from the arm's base. Shape (7,).
        joints_rad: Joint angles of the arm. Shape (N,) [rad].
    """

    receptacle: Array
    joints_rad: Array

    @classmethod
    def sample(cls, random: np.random.Generator, box: Box, cell: Cell) -> Placement:
        """Draw a receptacle anywhere in a box, with the arm near its rest."""
        receptacle = box.sample(random)
        robot = cell.robot
        home, std = np.array(robot.home_rad), np.array(robot.home_std_rad)
        return cls(receptacle, home + random.normal(size=home.size) * std)

    @classmethod
    def seated(cls, random: np.random.Generator, box: Box, cell: Cell) -> Placement:
        """Draw a receptacle anywhere in a box, with the plug seated in it."""
        receptacle, joints_rad = cls.sample(random, box, cell)
        way_in = InsertionTrajectory(Kinematics(cell))
        for _ in way_in.go(joints_rad, receptacle):
            pass
        aside, tilt = random.uniform(-_ASIDE_M, _ASIDE_M, 2), random.uniform(-_TILT_RAD, _TILT_RAD, 2)
        depth_m = cell.receptacle.depth_m - random.uniform(*_OFF_BOTTOM_M)
        seat = POSE.exp(
            np.array([*aside, depth_m, 1.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, *tilt, 0.0])
        )
        way_in.reach(compose(receptacle, seat))
        return cls(receptacle, way_in.kinematics.joints_rad)
