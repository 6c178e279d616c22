"""Takes the pictures of the arm for the documentation: `make pictures`. The job runs, with its contacts, as in the tests."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from farhand.common.arm.compliance import SeenReceptacle
from farhand.common.arm.kinematics import compose, moved
from farhand.common.arm.servo import Servo, ServoSettings
from farhand.common.arm.setpoint import MotionLimits
from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.rendering import Renderer, RenderingUnavailable
from farhand.common.arm.simulation.scene import CLOSE_UP, OPERATOR
from farhand.common.arm.simulation.simulation import TICK_S, Simulation
from tests.cells import JACO

FOLDER = Path(__file__).parents[3] / "docs" / "pictures"
SIZE = 1280, 720
_TURNED = np.array([0.0, 0.02, 0.0, 0.08, -0.10, 0.0])
"""How the receptacle stands in the pictures [m, rad]."""


def main() -> int:
    """Take them.

    Returns:
        The exit status.
    """
    simulation = Simulation(JACO)
    still = Surroundings.still(JACO)
    around = still.with_receptacle(moved(still.receptacle, _TURNED))
    simulation.reset(np.array(JACO.robot.home_rad), around)
    try:
        with Renderer(simulation, *SIZE) as renderer:
            save(renderer.render(OPERATOR), "hot-stab-scene")
            insert(simulation, around)
            save(renderer.render(CLOSE_UP), "hot-stab-seated")
    except RenderingUnavailable as error:
        sys.stderr.write(f"pictures: {error}\n")
        return 1
    return 0


def insert(simulation: Simulation, around: Surroundings) -> None:
    """Go in along the axis until the plug is seated."""
    servo = Servo(
        simulation.cell, ServoSettings(MotionLimits.of(simulation.cell.robot)), simulation.joints_rad
    )
    while simulation.time_s < 9.5:
        servo.set_receptacle(SeenReceptacle(simulation.mouth, np.zeros(6)))
        depth_m = float(np.interp(simulation.time_s, [3.0, 8.0], [-0.12, 0.083]))
        goal = compose(simulation.mouth, np.array([0.0, 0.0, depth_m, 1.0, 0.0, 0.0, 0.0]))
        simulation.step(servo.follow(goal, 0.15, TICK_S), around)
        servo.measure(simulation.joints_rad, simulation.wrench)


def save(picture: np.ndarray, name: str) -> None:
    """Write one as PNG."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture).save(FOLDER / f"{name}.png", optimize=True)


if __name__ == "__main__":
    sys.exit(main())
