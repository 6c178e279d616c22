"""The simulated arm's camera, drawn for real: it sees the receptacle where its view says, and comes out of its process."""

from __future__ import annotations

from collections.abc import Iterator
from ctypes.util import find_library
from io import BytesIO

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from farhand.common.arm.kinematics import compose, inverse
from farhand.common.arm.simulation.rendering import RenderingUnavailable
from farhand.common.arm.simulation.starts_and_goals import Box
from farhand.deploy.places import find_task
from farhand.remote_site.camera.camera_process import CameraProcess, camera_of
from farhand.remote_site.camera.picture_plan import CameraFailed
from farhand.remote_site.camera.process import Wanted
from farhand.remote_site.camera.simulated_camera import SimulatedCamera
from farhand.remote_site.camera.still import make_still
from farhand.remote_site.config import DriverChoice, RemoteConfig
from tests.cells import JACO

pytestmark = pytest.mark.rendering

BOX = Box.of(JACO.robot)
FACING = (0.5, -0.5, 0.5, -0.5)
HOME = np.array(JACO.robot.home_rad)


def mouth_at(share: float) -> NDArray[np.float64]:
    """Pose of a receptacle between the corners of the region in which it may be. Shape (7,)."""
    low_m, high_m = np.array(BOX.low_m), np.array(BOX.high_m)
    return np.concatenate([low_m + share * (high_m - low_m), FACING])


@pytest.fixture(scope="module")
def camera() -> Iterator[SimulatedCamera]:
    try:
        camera = SimulatedCamera(JACO)
    except RenderingUnavailable as error:
        pytest.skip(f"NO OPENGL on this machine: the robot's camera is not tested ({error})")
    yield camera
    camera.close()


def bronze(pixels: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Middle of what is bronze: the receptacle's housing alone is. Shape (2,) [px]."""
    red, green, blue = np.moveaxis(pixels.astype(float), 2, 0)
    mask = (red > 70) & (blue > 0.3 * red) & (blue < 0.65 * red) & (green < 0.9 * red)
    assert mask.sum() > 50, "no receptacle in the picture"
    return np.argwhere(mask)[:, ::-1].mean(axis=0)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_the_receptacle_is_where_the_view_says_wherever_it_may_be(camera: SimulatedCamera, share: float):
    mouth = mouth_at(share)
    camera.show(HOME, mouth)
    still = make_still(camera.capture(), mouth, 8000)
    assert still.view is not None
    x, y, z = compose(inverse(np.array(still.view.pose)), mouth)[:3]
    at = np.array(still.view.centre_px) + still.view.focal_px * np.array([x, y]) / z
    assert 0.2 * still.width_px < at[0] < 0.8 * still.width_px
    found = bronze(np.asarray(Image.open(BytesIO(still.jpeg))))
    assert np.abs(found - at).max() < 0.08 * still.width_px, (found, at)


def test_the_arm_is_seen_as_its_joints_are(camera: SimulatedCamera):
    mouth = mouth_at(0.5)
    camera.show(HOME, mouth)
    before = camera.capture().pixels.astype(int)
    camera.show(HOME + 0.1 * np.eye(6)[0], mouth)
    changed = (np.abs(camera.capture().pixels.astype(int) - before).max(axis=2) > 20).mean()
    assert 0.005 < changed < 0.5
    camera.show(HOME, mouth)
    assert (camera.capture().pixels == before).all()


def test_its_own_process_gives_pictures_that_fit_a_narrow_link(camera: SimulatedCamera):
    task = find_task("hot-stab")
    process = camera_of(RemoteConfig(task="hot-stab"), task, JACO)
    assert process is not None
    mouth = tuple(mouth_at(0.5).tolist())
    try:
        still = process.take(Wanted(1800, tuple(HOME.tolist()), mouth, mouth))
    finally:
        process.close()
    assert len(still.jpeg) <= 1800
    bronze(np.asarray(Image.open(BytesIO(still.jpeg))))


def test_a_machine_that_cannot_draw_says_so_once_and_for_all(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    monkeypatch.setenv("PYOPENGL_PLATFORM", "osmesa")
    if find_library("OSMesa"):
        pytest.skip("OSMesa is installed")
    process = camera_of(RemoteConfig(task="hot-stab"), find_task("hot-stab"), JACO)
    assert process is not None
    with pytest.raises(CameraFailed, match="nothing to draw with") as failed:
        process.take(Wanted(1800))
    process.close()
    assert failed.value.lasting


def test_only_the_simulated_arm_has_a_camera_unless_one_is_chosen():
    planar, arm = find_task("planar"), find_task("hot-stab")
    assert camera_of(RemoteConfig(), planar, None) is None
    assert camera_of(RemoteConfig(camera=DriverChoice("none")), arm, JACO) is None
    assert (
        camera_of(RemoteConfig(arm_driver=DriverChoice("mine"), perception=DriverChoice("mine")), arm, JACO)
        is None
    )
    assert isinstance(camera_of(RemoteConfig(camera=DriverChoice("mine")), planar, None), CameraProcess)
