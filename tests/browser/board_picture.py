"""What the operator sees on the boards, by its colours."""

from __future__ import annotations

import io
import math
import re
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import FloatRect, expect

if TYPE_CHECKING:
    from tests.browser.operator_page import OperatorPage, Point

_INSIDE_M = 0.03


def await_boards(tab: OperatorPage) -> None:
    """Wait until both boards are drawn where they belong: blue left and brown right."""
    corners = [(x, y) for x in (_INSIDE_M, 1.0 - _INSIDE_M) for y in (_INSIDE_M, 1.0 - _INSIDE_M)]

    def misplaced() -> str:
        picture = picture_of(tab.page.screenshot())
        blue = [blueness(picture, tab.pixel(corner)) for corner in corners]
        brown = [-blueness(picture, tab.pixel(corner, remote=True)) for corner in corners]
        wrong = min(*blue, *brown) <= 15
        return f"the boards are not drawn where they belong: {blue}, {brown}" if wrong else ""

    tab.draw_until(misplaced)


def await_point(tab: OperatorPage, at_m: Point, within_m: float = 0.03) -> Point:
    """Wait until the amber point is seen near a place of the remote board; returns where it is [m]."""
    _hide_trace(tab)
    seen = at_m

    def elsewhere() -> str:
        nonlocal seen
        if (found := seen_point(tab)) is not None and math.dist(found, at_m) <= within_m:
            seen = found
            return ""
        return f"the robot's point was expected at {at_m}, and seen at {found}"

    tab.draw_until(elsewhere)
    return seen


def _hide_trace(tab: OperatorPage) -> None:
    """Hide the way that the robot went, which is as amber as the robot."""
    chip = tab.page.get_by_role("button", name="Trace", exact=True)
    red, green, blue, *_ = map(
        int, re.findall(r"\d+", chip.evaluate("it => getComputedStyle(it).backgroundColor"))
    )
    if red - blue > 75 and green > 100:
        chip.click()
        expect(chip).not_to_have_css("background-color", f"rgb({red}, {green}, {blue})")


def seen_point(tab: OperatorPage) -> Point | None:
    """Where the amber point is on the remote board [m]; None when it is not to be seen."""
    left, top = tab.pixel((_INSIDE_M, 1.0 - _INSIDE_M), remote=True)
    right, bottom = tab.pixel((1.0 - _INSIDE_M, _INSIDE_M), remote=True)
    clip: FloatRect = {"x": left, "y": top, "width": right - left, "height": bottom - top}
    red, green, blue = picture_of(tab.page.screenshot(clip=clip))
    rows, columns = np.nonzero((red > 150) & (red - blue > 75) & (red - green > 25) & (green > 100))
    if rows.size == 0:
        return None
    height, width = red.shape
    side = 1.0 - 2.0 * _INSIDE_M
    x, y = (np.mean(columns) + 0.5) / width, (np.mean(rows) + 0.5) / height
    return float(_INSIDE_M + side * x), float(1.0 - _INSIDE_M - side * y)


def blueness(picture: NDArray[np.int_], pixel: Point) -> int:
    """How much more blue than red there is at a pixel."""
    column, row = map(int, pixel)
    return picture[2, row, column] - picture[0, row, column]


def picture_of(png: bytes) -> NDArray[np.int_]:
    """Red, green and blue. Shape (3, height, width)."""
    return np.moveaxis(np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=int), -1, 0)
