"""`farhand robot check` and `farhand robot place`: what a robot file makes of its model."""

from __future__ import annotations

import sys

import numpy as np

from farhand.common.arm.cell import Cell
from farhand.common.arm.kinematics import Kinematics
from farhand.common.arm.placing import Place, examine, search
from farhand.common.arm.robot_file import RobotFile
from farhand.common.arm.simulation.description import MOST_BYTES, describe
from farhand.common.errors import InvalidConfiguration
from farhand.deploy.places import find_robot

_MOST_CANDIDATES = 100_000


def check(name_or_file: str) -> int:
    """Say what a robot is like, and whether it reaches its workplace.

    Returns:
        0, or 1 for a workplace that the pre-flight check does not admit everywhere.

    Raises:
        InvalidConfiguration: When there is no such robot, or its file does not fit its model.
    """
    robot = find_robot(name_or_file)
    kinematics = Kinematics(Cell(robot=robot))
    model = kinematics.model
    _say(f"{robot.source}: {len(robot.joints)} joints, {robot.medium}")
    for number, name in enumerate(robot.joints):
        low, high = np.degrees(model.jnt_range[number]) if model.jnt_limited[number] else (-np.inf, np.inf)
        mass_kg = model.body_mass[model.body_weldid == model.jnt_bodyid[number]].sum()
        home = np.degrees(robot.home_rad[number])
        _say(
            f"  {name:20s}  {low:7.0f} to {high:4.0f} degrees, at rest {home:5.0f}; moves a link of {mass_kg:.2f} kg"
        )
    tool_kg, _ = kinematics.tool_weight()
    x, y, z = kinematics.tip[:3]
    _say(
        f"  tool                  {tool_kg:.2f} kg behind the wrist; tip at rest at {x:.3f}, {y:.3f}, {z:.3f} m"
    )
    _say(f"  singular value        {kinematics.least_singular_value():.3f} at rest")
    place = examine(robot)
    _say_place(place)
    size = len(describe(kinematics.cell).content)
    _say(f"  looks                 {size / 1000:.0f} of at most {MOST_BYTES / 1000:.0f} kB")
    return 0 if place.n_reached == place.n_examined else 1


def place(name_or_file: str, n_candidates: int, seed: int) -> int:
    """Search a base and a rest posture, and print them as the file has them.

    Returns:
        0, or 1 when none was found that reaches the whole workplace.

    Raises:
        InvalidConfiguration: When there is no such robot, its file does not fit its model, or a number is out of range.
    """
    if not 0 <= n_candidates <= _MOST_CANDIDATES or seed < 0:
        expected = f"0 to {_MOST_CANDIDATES}, and zero or more, got {n_candidates}, {seed}"
        raise InvalidConfiguration("command line", "candidates, seed", expected)
    found = search(find_robot(name_or_file), seed, n_candidates)
    _say_place(found)
    _say_toml(found.robot)
    return 0 if found.n_reached == found.n_examined else 1


def _say_place(place: Place) -> None:
    words = f"{place.n_reached} of {place.n_examined} receptacles, least singular value {place.least_singular_value:.3f}"
    _say(f"  workplace             the pre-flight check admits {words}")


def _say_toml(robot: RobotFile) -> None:
    base = robot.base
    _say(f"base = {{ pos_m = {list(base.pos_m)}, quat_wxyz = {list(base.quat_wxyz)} }}")
    _say(f"home_rad = {list(robot.home_rad)}")


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
