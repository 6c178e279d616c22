"""Where the operator sees the robot's point: by its colour in the picture of the remote board."""

from __future__ import annotations

import io
import math

import numpy as np
from PIL import Image

from tests.browser.operator_page import OperatorPage, Point

_INSIDE_M = 0.03
_FRAMES = 600


def await_point(tab: OperatorPage, at_m: Point, within_m: float = 0.03) -> Point:
    """Wait until the amber point is seen near a place of the remote board; returns where it is [m]."""
    seen: Point | None = None
    for _ in range(_FRAMES):
        seen = seen_point(tab)
        if seen is not None and math.dist(seen, at_m) <= within_m:
            return seen
        tab.page.evaluate("() => new Promise(requestAnimationFrame)")
    raise AssertionError(f"the robot's point was expected at {at_m}, and seen at {seen}")


def seen_point(tab: OperatorPage) -> Point | None:
    """Where the amber point is on the remote board [m]; None when it is not to be seen."""
    left, top = tab.pixel((_INSIDE_M, 1.0 - _INSIDE_M), remote=True)
    right, bottom = tab.pixel((1.0 - _INSIDE_M, _INSIDE_M), remote=True)
    clip = {"x": left, "y": top, "width": right - left, "height": bottom - top}
    image = Image.open(io.BytesIO(tab.page.screenshot(clip=clip))).convert("RGB")  # pyright: ignore[reportArgumentType]
    red, green, blue = np.moveaxis(np.asarray(image, dtype=int), -1, 0)
    rows, columns = np.nonzero((red > 150) & (red - blue > 75) & (red - green > 25) & (green > 100))
    if rows.size == 0:
        return None
    part = (np.mean(columns) + 0.5) / image.width, (np.mean(rows) + 0.5) / image.height
    side = 1.0 - 2.0 * _INSIDE_M
    return float(_INSIDE_M + side * part[0]), float(1.0 - _INSIDE_M - side * part[1])
