"""Places of the two arms in the scene, and the camera that sees both alike."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.local_site.view.scene.board.boards import BOTTOM, TOP

Array = NDArray[np.float64]

FOV_RAD = 0.30
"""Vertical field of view: narrow, so that both arms are seen from nearly the same side [rad]."""
_HEADING_RAD, _PITCH_RAD = math.radians(52.0), math.radians(-20.0)
"""Where the camera looks: from beside and behind the arms at their receptacles, down a little."""
_CENTRE_M = np.array([0.54, 0.0, 0.31])
"""What is in the middle of an arm's half, from its base [m]."""
_WIDTH_M, _HEIGHT_M = 1.28, 1.0
"""What each half shows at least [m]."""

_ACROSS = np.array([math.sin(_HEADING_RAD), -math.cos(_HEADING_RAD), 0.0])
_FORWARDS = np.array(
    [
        math.cos(_PITCH_RAD) * math.cos(_HEADING_RAD),
        math.cos(_PITCH_RAD) * math.sin(_HEADING_RAD),
        math.sin(_PITCH_RAD),
    ]
)
_UP = np.cross(_ACROSS, _FORWARDS)


def base_m(remote: bool) -> Array:
    """Return the place of an arm's base in the scene. Shape (3,) [m]."""
    return (0.5 if remote else -0.5) * _WIDTH_M * _ACROSS - _CENTRE_M


@dataclass(frozen=True, eq=False)
class ArmCamera:
    """Camera on both arms.

    Args:
        centre_m: Point of the scene in the middle of the canvas. Shape (3,) [m].
        pixels_per_m: Scale at that point.
        size_px: Width and height of the canvas.
    """

    centre_m: Array
    pixels_per_m: float
    size_px: tuple[float, float]

    @property
    def distance_m(self) -> float:
        """Distance of the camera from the centre [m]."""
        return 0.5 * self.size_px[1] / self.pixels_per_m / math.tan(0.5 * FOV_RAD)

    @property
    def position_m(self) -> Array:
        """Position of the camera. Shape (3,) [m]."""
        return self.centre_m - self.distance_m * _FORWARDS

    def pixel(self, point_m: Array) -> tuple[float, float]:
        """Project a point of the scene onto the canvas, from its upper left corner [px]."""
        sight = np.asarray(point_m) - self.position_m
        scale = self.pixels_per_m * self.distance_m / float(sight @ _FORWARDS)
        width, height = self.size_px
        return 0.5 * width + scale * float(sight @ _ACROSS), 0.5 * height - scale * float(sight @ _UP)


def arm_camera(size_px: tuple[float, float]) -> ArmCamera:
    """Return the view that fits both arms between the strips of a canvas.

    Args:
        size_px: Width and height of the canvas.
    """
    width_px, height_px = size_px
    free_px = (1.0 - TOP - BOTTOM) * height_px
    scale = min(width_px / (2.0 * _WIDTH_M), free_px / _HEIGHT_M)
    below_px = 0.5 * height_px - (TOP * height_px + 0.5 * free_px)
    return ArmCamera(-below_px / scale * _UP, scale, size_px)
