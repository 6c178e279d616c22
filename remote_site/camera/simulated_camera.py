"""Camera of the simulated arm: it stands beside the receptacle and sees what the simulation says is there."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.cell import Cell
from farhand.common.arm.engine import mujoco
from farhand.common.arm.simulation.receptacle import joints_at
from farhand.common.arm.simulation.rendering import Renderer
from farhand.common.arm.simulation.scene import CLOSE_UP
from farhand.common.arm.simulation.simulation import Simulation
from farhand.remote_site.interface.camera import CameraImage, CameraView

Array = NDArray[np.float64]

_WIDTH, _HEIGHT, _FOVY_DEG = 640, 480, 50.0
"""Size and field of view: the receptacle is in sight wherever it may be, and the region of interest is cut out."""
_TURNED = np.array([0.0, 1.0, 0.0, 0.0])
"""Half a turn about the first axis, from OpenGL's axes of a camera (right, up, back) to right, down, forwards."""


class SimulatedCamera:
    """Camera that draws the scene without shadows, which would take six times as long. Used by one thread.

    Args:
        cell: Arm in front of its receptacle.

    Raises:
        RenderingUnavailable: When this machine has neither EGL nor OSMesa.
    """

    def __init__(self, cell: Cell):
        simulation = Simulation(cell)
        self._model, self._data = simulation.model_and_data()
        self._n_joints = len(cell.robot.joints)
        camera = self._model.camera(CLOSE_UP)
        camera.fovy[0] = _FOVY_DEG
        self._renderer = Renderer(simulation, _WIDTH, _HEIGHT, shadows=False)
        self._view = self._seen_from()

    def show(self, joints_rad: Array, receptacle: Array) -> None:
        """See `SceneCamera.show`."""
        self._data.qpos[: self._n_joints] = joints_rad
        self._data.qpos[self._n_joints :] = joints_at(receptacle)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)

    def capture(self) -> CameraImage:
        """See `Camera.capture`."""
        return CameraImage(self._renderer.render(CLOSE_UP), self._view)

    def close(self) -> None:
        """Release the OpenGL context."""
        self._renderer.close()

    def _seen_from(self) -> CameraView:
        camera, own, turned = self._data.camera(CLOSE_UP), np.empty(4), np.empty(4)
        mujoco.mju_mat2Quat(own, camera.xmat)
        mujoco.mju_mulQuat(turned, own, _TURNED)
        focal_px = 0.5 * _HEIGHT / math.tan(0.5 * math.radians(_FOVY_DEG))
        return CameraView(np.concatenate([camera.xpos, turned]), focal_px)
