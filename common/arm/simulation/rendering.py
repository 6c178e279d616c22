"""Pictures of the simulation, drawn without a screen by an available OpenGL: EGL or OSMesa."""

from __future__ import annotations

import importlib
import logging
from ctypes.util import find_library
from typing import Any

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.cell import HIDDEN
from farhand.common.arm.engine import WANTED_GL, mujoco
from farhand.common.arm.simulation.simulation import Simulation
from farhand.common.errors import FarhandError

_LIBRARIES = {"egl": "EGL", "osmesa": "OSMesa"}
_MOST_GEOMS = 2000
_ROOM, _AZIMUTH_DEG, _ELEVATION_DEG = 1.5, 52.0, -18.0


class RenderingUnavailable(FarhandError):
    """Lack of an OpenGL that works without a screen on this machine."""


class Renderer:
    """Renderer of a simulation through its cameras. Close it, or use it as a context manager.

    Args:
        simulation: Simulation to draw.
        width: Width of the pictures, at most 1920 [pixels].
        height: Height of the pictures, at most 1080 [pixels].
        shadows: Draw shadows and smooth edges; without a graphics card both take most of the time.

    Raises:
        RenderingUnavailable: When this machine has neither EGL nor OSMesa.
    """

    def __init__(self, simulation: Simulation, width: int = 960, height: int = 540, shadows: bool = True):
        self._context = _open_context(width, height)
        self._context.make_current()
        self._model, self._data = simulation.model_and_data()
        self._size = height, width
        if not shadows:
            self._model.vis.quality.offsamples = 0
        self._scene = mujoco.MjvScene(self._model, maxgeom=_MOST_GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = 1
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
        self._options = mujoco.MjvOption()
        self._options.geomgroup[HIDDEN] = 0
        self._camera = mujoco.MjvCamera()
        self._drawing = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._drawing)

    def render(self, camera: str) -> NDArray[np.uint8]:
        """Render the picture of one of the scene's cameras. Shape (height, width, 3)."""
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = self._model.camera(camera).id
        return self._render()

    def render_around(self, points_m: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Render the picture of all these points [m], seen from the side and from above. Shape (height, width, 3)."""
        low, high = points_m.min(0), points_m.max(0)
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FREE
        self._camera.lookat[:] = 0.5 * (low + high)
        self._camera.distance = _ROOM * float(np.linalg.norm(high - low))
        self._camera.azimuth, self._camera.elevation = _AZIMUTH_DEG, _ELEVATION_DEG
        return self._render()

    def _render(self) -> NDArray[np.uint8]:
        height, width = self._size
        self._context.make_current()
        mujoco.mjv_updateScene(
            self._model,
            self._data,
            self._options,
            None,
            self._camera,
            mujoco.mjtCatBit.mjCAT_ALL,
            self._scene,
        )
        picture = np.empty((height, width, 3), dtype=np.uint8)
        area = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(area, self._scene, self._drawing)
        mujoco.mjr_readPixels(picture, None, area, self._drawing)
        return picture[::-1]

    def close(self) -> None:
        """Release the OpenGL context."""
        self._context.make_current()
        self._drawing.free()
        self._context.free()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _open_context(width: int, height: int) -> Any:
    # PyOpenGL selects one library for the whole process, so it is chosen before the first attempt.
    installed = (name for name, library in _LIBRARIES.items() if find_library(library))
    logging.getLogger("OpenGL").setLevel(logging.WARNING)  # it tells which of its accelerators are missing
    backend = WANTED_GL if WANTED_GL in _LIBRARIES else next(installed, "egl")
    try:
        return importlib.import_module(f"mujoco.{backend}").GLContext(width, height)
    except (ImportError, AttributeError, RuntimeError) as error:  # PyOpenGL raises this without its library
        raise RenderingUnavailable(
            f"nothing to draw with ({backend}: {error}); Debian: apt-get install libegl1 libegl-mesa0 "
            "libgl1-mesa-dri, or libosmesa6 with MUJOCO_GL=osmesa"
        ) from error
