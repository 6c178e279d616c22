"""Places of the two arms in the scene, and the cameras that look at them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.local_site.view.panels.words.controls import ViewName

Array = NDArray[np.float64]

FOV_RAD = 0.30
"""Vertical field of view: narrow, so that both arms are seen from nearly the same side [rad]."""
_HEADING_RAD, _PITCH_RAD = math.radians(52.0), math.radians(-20.0)
"""Usual direction of sight: from beside and behind the arms at their receptacles, down a little."""
_CENTRE_M = np.array([0.54, 0.0, 0.31])
"""Point in the middle of an arm's half, from its base [m]."""
_WIDTH_M, _HEIGHT_M = 1.28, 1.0
"""Least extent that each half shows [m]."""
_MOUTH_M = np.array([0.80, 0.0, 0.36])
"""Usual place of a receptacle, from the arm's base [m]."""


def _axes(heading_rad: float, pitch_rad: float) -> tuple[Array, Array, Array]:
    """Return the directions across, forwards and up of a camera. Each of shape (3,)."""
    across = np.array([math.sin(heading_rad), -math.cos(heading_rad), 0.0])
    level = math.cos(pitch_rad)
    forwards = np.array([level * math.cos(heading_rad), level * math.sin(heading_rad), math.sin(pitch_rad)])
    return across, forwards, np.cross(across, forwards)


def base_m(remote: bool) -> Array:
    """Return the place of an arm's base in the scene. Shape (3,) [m]."""
    across, _, _ = _axes(_HEADING_RAD, _PITCH_RAD)
    return (0.5 if remote else -0.5) * _WIDTH_M * across - _CENTRE_M


@dataclass(frozen=True, eq=False)
class ArmCamera:
    """Camera on the arms.

    Args:
        centre_m: Point of the scene in the middle of the canvas. Shape (3,) [m].
        pixels_per_m: Scale at that point.
        size_px: Width and height of the canvas.
        heading_rad: Direction of sight about the vertical.
        pitch_rad: Direction of sight above the horizontal.
    """

    centre_m: Array
    pixels_per_m: float
    size_px: tuple[float, float]
    heading_rad: float = _HEADING_RAD
    pitch_rad: float = _PITCH_RAD

    @property
    def distance_m(self) -> float:
        """Distance of the camera from the centre [m]."""
        return 0.5 * self.size_px[1] / self.pixels_per_m / math.tan(0.5 * FOV_RAD)

    @property
    def position_m(self) -> Array:
        """Position of the camera. Shape (3,) [m]."""
        return self.centre_m - self.distance_m * _axes(self.heading_rad, self.pitch_rad)[1]

    def pixel(self, point_m: Array) -> tuple[float, float]:
        """Project a point of the scene onto the canvas, from its upper left corner [px]."""
        across, forwards, up = _axes(self.heading_rad, self.pitch_rad)
        sight = np.asarray(point_m) - self.position_m
        scale = self.pixels_per_m * self.distance_m / float(sight @ forwards)
        width, height = self.size_px
        return 0.5 * width + scale * float(sight @ across), 0.5 * height - scale * float(sight @ up)


@dataclass(frozen=True, eq=False)
class _View:
    """Named view: its direction, its centre, and the extent that it shows at least [m]."""

    centre_m: Array
    width_m: float
    height_m: float
    heading_rad: float = _HEADING_RAD
    pitch_rad: float = _PITCH_RAD


_VIEWS: dict[str, _View] = {
    ViewName.BOTH: _View(np.zeros(3), 2.0 * _WIDTH_M, _HEIGHT_M),
    ViewName.MINE: _View(base_m(False) + _CENTRE_M, _WIDTH_M, _HEIGHT_M),
    ViewName.ROBOT: _View(base_m(True) + _CENTRE_M, _WIDTH_M, _HEIGHT_M),
    ViewName.BEHIND: _View(base_m(False) + _MOUTH_M, 0.8, 0.62, math.radians(24.0), math.radians(-38.0)),
    ViewName.BORE: _View(base_m(True) + _MOUTH_M, 0.5, 0.42, math.radians(66.0), math.radians(-12.0)),
    ViewName.TOP: _View(np.zeros(3), 2.0 * _WIDTH_M, _HEIGHT_M, _HEADING_RAD, math.radians(-80.0)),
}
VIEWS: tuple[str, ...] = tuple(_VIEWS)
"""Names of the views; the first one shows all."""
TEACHING_VIEW: str = ViewName.BEHIND
"""Name of the view in which the arrows at the plug are best told apart."""


def arm_camera(size_px: tuple[float, float], view: str = VIEWS[0]) -> ArmCamera:
    """Return a camera that fits a view into a canvas.

    Args:
        size_px: Width and height of the canvas.
        view: Name of the view.
    """
    shown = _VIEWS[view]
    scale = min(size_px[0] / shown.width_m, size_px[1] / shown.height_m)
    return ArmCamera(shown.centre_m, scale, size_px, shown.heading_rad, shown.pitch_rad)
