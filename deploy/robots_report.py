"""`farhand robot check`, `place` and `show`: what a robot file makes of its model."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from farhand.common.arm.cell import Cell
from farhand.common.arm.kinematics import Kinematics
from farhand.common.arm.placing import Place, corners, examine, search
from farhand.common.arm.robot_file import RobotFile
from farhand.common.arm.simulation.description import MOST_BYTES, describe
from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.rendering import Renderer
from farhand.common.arm.simulation.simulation import Simulation
from farhand.common.errors import InvalidConfiguration
from farhand.common.whole_file import write_whole
from farhand.deploy.places import find_robot

_MOST_CANDIDATES = 100_000
_PICTURE = 1280, 720


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


def show(name_or_file: str, picture: Path) -> int:
    """Draw a robot at rest before the receptacle in the middle of its workplace.

    Returns:
        0.

    Raises:
        InvalidConfiguration: When there is no such robot, its file does not fit its model, or the picture cannot be
            written there.
        RenderingUnavailable: When this machine has nothing to draw with.
    """
    robot = find_robot(name_or_file)
    cell = Cell(robot=robot)
    simulation = Simulation(cell)
    middle = next(corners(robot))
    around = Surroundings.still(cell).with_receptacle(middle)
    simulation.reset(np.array(robot.home_rad), around)
    model, data = simulation.model_and_data()
    links = [body for body in range(model.nbody) if model.body(body).name.startswith(("arm/", "tool/"))]
    with Renderer(simulation, *_PICTURE) as renderer:
        drawn = Image.fromarray(renderer.render_around(np.vstack([data.xpos[links], middle[:3]])))
    content = io.BytesIO()
    drawn.save(content, "PNG", optimize=True)
    try:
        write_whole(picture, content.getvalue())
    except OSError as error:
        raise InvalidConfiguration("command line", "out", f"a file that can be written: {error}") from error
    _say(f"{robot.source}: drawn at rest into {picture}")
    return 0


def _say_place(place: Place) -> None:
    words = f"{place.n_reached} of {place.n_examined} receptacles, least singular value {place.least_singular_value:.3f}"
    _say(f"  workplace             the pre-flight check admits {words}")


def _say_toml(robot: RobotFile) -> None:
    base = robot.base
    _say(f"base = {{ pos_m = {list(base.pos_m)}, quat_wxyz = {list(base.quat_wxyz)} }}")
    _say(f"home_rad = {list(robot.home_rad)}")


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
