"""Pictures of the scene show what they should. They need EGL or OSMesa, unlike everything else."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.rendering import Renderer, RenderingUnavailable
from farhand.common.arm.simulation.scene import CLOSE_UP, OPERATOR
from farhand.common.arm.simulation.simulation import Simulation
from tests.cells import JACO

pytestmark = pytest.mark.rendering

SIMULATION = Simulation(JACO)
HOME = np.array(JACO.robot.home_rad)
STILL = Surroundings.still(JACO)


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    try:
        with Renderer(SIMULATION, 320, 180) as renderer:
            yield renderer
    except RenderingUnavailable as error:
        pytest.skip(f"NO OPENGL on this machine: pictures of the arm are not tested ({error})")


def share(picture: np.ndarray, low: tuple[int, int, int], high: tuple[int, int, int]) -> float:
    """Share of the pixels between two colours."""
    return float(((picture >= low) & (picture <= high)).all(axis=2).mean())


@pytest.mark.parametrize("camera", [OPERATOR, CLOSE_UP])
def test_a_camera_sees_the_yellow_panel_in_blue_water(renderer: Renderer, camera: str):
    SIMULATION.reset(HOME, STILL)
    picture = renderer.render(camera)
    assert picture.shape == (180, 320, 3)
    assert share(picture, (140, 100, 0), (255, 220, 60)) > 0.05
    assert share(picture, (0, 20, 30), (30, 90, 110)) > 0.1


def test_what_moves_in_the_physics_moves_in_the_picture(renderer: Renderer):
    SIMULATION.reset(HOME, STILL)
    before = renderer.render(OPERATOR).astype(int)
    assert (before == renderer.render(OPERATOR)).all()
    SIMULATION.reset(HOME + 0.3 * np.eye(6)[0], STILL)
    changed = (np.abs(renderer.render(OPERATOR).astype(int) - before).max(axis=2) > 20).mean()
    assert 0.01 < changed < 0.5
