"""Where the camera stands so that both boards fill the page between its two strips."""

from __future__ import annotations

import math
from dataclasses import dataclass

FOV_RAD = 0.35
"""Vertical field of view: narrow, so that nothing looks tilted [rad]."""
GAP = 0.07
"""Space between the boards, in board widths."""
MARGIN = 0.03
"""Space around both, in board widths."""
TOP, BOTTOM = 0.13, 0.21
"""Heights of the status strip with the boards' titles and of the lower strip, in page heights; as in page.css.

Not in pixels: a tab tells the size of its canvas in the screen's pixels, which may be finer than the page's.
"""


def board_origin_m(remote: bool, width_m: float) -> tuple[float, float]:
    """Lower left corner of a board in the scene [m]; the scene's origin is midway between the two."""
    return (0.5 * GAP * width_m if remote else -(1.0 + 0.5 * GAP) * width_m, 0.0)


@dataclass(frozen=True)
class View:
    """A camera that looks straight down on the boards.

    Args:
        centre_m: Point of the scene in the middle of the canvas [m].
        pixels_per_m: Scale on the boards.
        size_px: Width and height of the canvas.
    """

    centre_m: tuple[float, float]
    pixels_per_m: float
    size_px: tuple[float, float]

    @property
    def height_m(self) -> float:
        """Height of the camera above the boards [m]."""
        return self.size_px[1] / self.pixels_per_m / (2.0 * math.tan(0.5 * FOV_RAD))

    def pixel(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Where a point of the scene is on the canvas, from its upper left corner [px]."""
        return (
            0.5 * self.size_px[0] + (x_m - self.centre_m[0]) * self.pixels_per_m,
            0.5 * self.size_px[1] - (y_m - self.centre_m[1]) * self.pixels_per_m,
        )


def view_of(board_m: tuple[float, float], size_px: tuple[float, float]) -> View:
    """The view that fits two boards of this size into a canvas.

    Args:
        board_m: Width and height of a board [m].
        size_px: Width and height of the canvas.
    """
    width_m, height_m = board_m
    width_px, height_px = size_px
    free_px = (1.0 - TOP - BOTTOM) * height_px
    scale = min(
        width_px / ((2.0 + GAP + 2.0 * MARGIN) * width_m), free_px / (height_m + 2.0 * MARGIN * width_m)
    )
    middle_px = TOP * height_px + 0.5 * free_px
    return View((0.0, 0.5 * height_m + (middle_px - 0.5 * height_px) / scale), scale, size_px)
