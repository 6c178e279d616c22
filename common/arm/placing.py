"""Search for where a robot's base should stand, and how it should rest, by the product's own pre-flight check."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from farhand.common.arm.cell import Cell
from farhand.common.arm.engine import mink, mujoco
from farhand.common.arm.kinematics import Kinematics, compose, difference, moved
from farhand.common.arm.preflight import Preflights
from farhand.common.arm.robot_file import RobotFile
from farhand.common.arm.simulation.receptacle import FACING_QUAT
from farhand.common.arm.simulation.starts_and_goals import Box

Array = NDArray[np.float64]

_BEFORE_M = 0.16
"""Distance of the resting tip before the nearest mouth [m]."""
_STD_MARGIN = 3.0
"""A resting joint is so many standard deviations inside its range."""
_LEAST_AT_HOME = 0.04
_ITERATIONS, _STEP_RAD = 60, 0.2
_CLOSE_M_RAD = 1e-3


@dataclass(frozen=True)
class Place:
    """Base and rest posture of a robot.

    Args:
        robot: The robot as placed.
        least_singular_value: Least one on the way into the worst receptacle of the workplace.
        n_reached: Number of the examined receptacles that the pre-flight check admits.
        n_examined: Number of examined receptacles.
    """

    robot: RobotFile
    least_singular_value: float
    n_reached: int
    n_examined: int


def examine(robot: RobotFile, at_least: float = 0.0) -> Place:
    """Examine the ways from the rest posture into the corners of the workplace and into its middle.

    Args:
        robot: The robot.
        at_least: Singular value below which the examination ends early.
    """
    preflights = Preflights(Kinematics(Cell(robot=robot)))
    receptacles, home = list(corners(robot)), np.array(robot.home_rad)
    least, reached = math.inf, 0
    for receptacle in receptacles:
        found = preflights.examine(home, receptacle)
        good = found.refusal is None
        reached += good
        least = min(least, found.least_singular_value if good else 0.0)
        if least < at_least:
            break
    return Place(robot, least, reached, len(receptacles))


def corners(robot: RobotFile) -> Iterator[Array]:
    """Return the receptacle in the middle of the workplace, and tilted outwards in its corners. Shape (7,) each."""
    box = Box.of(robot)
    middle = 0.5 * (np.array(box.low_m) + np.array(box.high_m))
    yield np.concatenate([middle, FACING_QUAT])
    for corner in itertools.product(*zip(box.low_m, box.high_m, strict=True)):
        aside = np.array([corner[0] - middle[0], corner[1] - middle[1], corner[2] - middle[2]])
        about = np.array([aside[2], 0.0, 0.0]) + np.array([0.0, aside[1], 0.0])
        turn = np.zeros(6)
        turn[3:] = box.tilt_rad * about / max(float(np.linalg.norm(about)), 1e-9)
        yield moved(np.concatenate([corner, FACING_QUAT]), turn)


def search(robot: RobotFile, seed: int, n_candidates: int, moves_base: bool = True) -> Place:
    """Search a base and a rest posture from which the whole workplace is reached, as far from singular as found.

    Args:
        robot: The robot; its own place is the first candidate.
        seed: Seed of the candidates.
        n_candidates: Number of candidates.
        moves_base: Whether the base may move; its orientation stays.
    """
    random = np.random.default_rng(seed)
    best = examine(robot)
    candidates = _Candidates(robot, random)
    for _ in range(n_candidates):
        found = candidates.draw(best.robot if best.n_reached else robot, moves_base)
        if found is None:
            continue
        place = examine(found, best.least_singular_value)
        if (place.n_reached, place.least_singular_value) > (best.n_reached, best.least_singular_value):
            best = place
    return best


class _Candidates:
    """Postures that hold the tip before the workplace, from a base somewhere near."""

    _SPREAD_M = np.array([0.15, 0.15, 0.15])

    def __init__(self, robot: RobotFile, random: np.random.Generator):
        self._random, self._robot = random, robot
        self._kinematics = Kinematics(Cell(robot=robot))
        self._base = self._kinematics.model.body("arm/").id
        self._limits = [mink.ConfigurationLimit(self._kinematics.model)]
        self._task = mink.FrameTask("tool/tip", "site", position_cost=1.0, orientation_cost=0.3)
        box = Box.of(robot)
        middle = 0.5 * (np.array(box.low_m) + np.array(box.high_m))
        self._rest_m = np.array([box.low_m[0] - _BEFORE_M, middle[1], middle[2]])

    def draw(self, near: RobotFile, moves_base: bool) -> RobotFile | None:
        """Return a candidate near another one; None when this one fails."""
        random, robot = self._random, self._robot
        base = np.array(near.base.pos_m)
        if moves_base:
            base = base + random.normal(size=3) * self._SPREAD_M
        self._kinematics.model.body_pos[self._base] = base
        roll = np.array([0.0, 0.0, 0.0, *_about_z(random.uniform(-math.pi, math.pi))])
        home = self._solve(
            compose(np.concatenate([self._rest_m, FACING_QUAT]), roll), np.array(near.home_rad)
        )
        if home is None:
            return None
        placed = structs.replace(robot.base, pos_m=tuple(np.round(base, 3).tolist()))
        return structs.replace(robot, base=placed, home_rad=tuple(np.round(home, 3).tolist()))

    def _solve(self, tip: Array, near: Array) -> Array | None:
        """Return joint angles well inside their ranges that hold the tip there."""
        kinematics, random = self._kinematics, self._random
        model, std = kinematics.model, np.array(self._robot.home_std_rad)
        limited = model.jnt_limited[: std.size] == 1
        low = np.where(limited, model.jnt_range[: std.size, 0] + _STD_MARGIN * std, -math.pi)
        high = np.where(limited, model.jnt_range[: std.size, 1] - _STD_MARGIN * std, math.pi)
        start = (
            near + random.normal(size=std.size) * 0.5 if random.random() < 0.5 else random.uniform(low, high)
        )
        kinematics.update(np.clip(start, low, high))
        configuration = kinematics.configuration
        self._task.set_target(mink.SE3(np.concatenate([tip[3:], tip[:3]])))
        for _ in range(_ITERATIONS):
            step = mink.solve_ik(configuration, [self._task], 1.0, "daqp", damping=1e-4, limits=self._limits)
            configuration.integrate_inplace(np.clip(step, -_STEP_RAD, _STEP_RAD), 1.0)
            if np.linalg.norm(difference(kinematics.tip, tip)) < _CLOSE_M_RAD:
                break
        else:
            return None
        found = kinematics.joints_rad
        inside = bool(((low <= found) & (found <= high)).all())
        return found if inside and kinematics.least_singular_value() >= _LEAST_AT_HOME else None


def _about_z(angle_rad: float) -> Array:
    quat = np.empty(4)
    mujoco.mju_axisAngle2Quat(quat, np.array([0.0, 0.0, 1.0]), angle_rad)
    return quat
