"""Both arms are in the picture, alike, and where the camera says."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.arm.simulation.description import describe
from farhand.common.model.task_frame import TaskFrame
from farhand.deploy.places import find_cell, find_task, robot_names
from farhand.local_site.view.scene.arm.arm_camera import FOV_RAD, VIEWS, Half, arm_camera
from tests.cells import JACO

HALF = Half.of(describe(JACO))
# The base, the plug at rest, and the corners of the panel's face, from an arm's base [m].
SEEN = [(0.0, 0.0, 0.05), (0.62, 0.0, 0.4), *((0.83, y, z) for y in (-0.3, 0.3) for z in (0.08, 0.68))]


@pytest.mark.parametrize("size", [(976, 720), (1616, 1080), (596, 560), (900, 900)])
def test_both_arms_are_between_the_strips_each_in_its_half(size: tuple[int, int]) -> None:
    camera = arm_camera(size, HALF, HALF)
    for remote in (False, True):
        for point in SEEN:
            across, down = camera.pixel(np.array(point) + HALF.base_m(remote))
            assert 0.0 < down < size[1]
            assert 0.0 < across - (0.5 * size[0] if remote else 0.0) < 0.55 * size[0]


def test_a_pixel_is_what_a_projection_matrix_says() -> None:
    """Against the usual OpenGL matrices: look-at, then perspective."""
    camera = arm_camera((1000, 600), HALF, HALF)
    eye, centre = camera.position_m, camera.centre_m
    back = (eye - centre) / np.linalg.norm(eye - centre)
    right = np.cross([0.0, 0.0, 1.0], back) / np.linalg.norm(np.cross([0.0, 0.0, 1.0], back))
    look = np.vstack([right, np.cross(back, right), back])
    for point in np.random.default_rng(3).normal(0.0, 0.5, (20, 3)):
        x, y, z = look @ (point - eye)
        f = 1.0 / np.tan(0.5 * FOV_RAD)
        expected = (500.0 + 300.0 * f * x / -z, 300.0 - 300.0 * f * y / -z)
        np.testing.assert_allclose(camera.pixel(point), expected, atol=1e-6)


@pytest.mark.parametrize("name", robot_names())
def test_whatever_arm_a_site_has_its_links_are_in_its_half_and_the_mouth_in_the_bore_s_view(
    name: str,
) -> None:
    cell = find_cell(find_task("hot-stab"), name)
    assert cell is not None
    description = describe(cell)
    half, size = Half.of(description), (1200, 700)
    poses = description.link_poses(description.home_rad)
    for own, robot, remote in ((HALF, half, True), (half, HALF, False)):
        both = arm_camera(size, own, robot)
        division, _ = both.pixel(np.zeros(3))
        tip = description.tip_pose(description.home_rad)
        for link, pose in zip(description.links[1:], poses[1:], strict=True):
            for mesh in link.meshes:
                for corner in TaskFrame.at(pose).to_world(mesh.vertices_m[::7].astype(float)):
                    across, down = both.pixel(corner + half.base_m(remote))
                    assert 0.0 < down < size[1] and 0.0 < across < size[0]
                    assert (across > division) is remote
        for view in VIEWS:
            across, down = arm_camera(size, own, robot, view).pixel(tip[:3] + half.base_m(remote))
            if view not in {"Mine", "Robot", "Behind", "Bore"} or remote == (view in {"Robot", "Bore"}):
                assert 0.0 < across < size[0] and 0.0 < down < size[1]
