"""Colours of the page: grey is normal, saturated is abnormal; local blue, remote amber, predicted magenta."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Rgb = tuple[int, int, int]

BACKDROP: Rgb = (27, 31, 38)
LOCAL_BOARD: Rgb = (30, 44, 66)
REMOTE_BOARD: Rgb = (58, 47, 33)
LOCAL_GRID: Rgb = (54, 73, 104)
REMOTE_GRID: Rgb = (92, 77, 57)
LOCAL: Rgb = (96, 165, 250)
REMOTE: Rgb = (251, 178, 60)
PREDICTED: Rgb = (232, 121, 249)
MISSES: Rgb = (239, 68, 68)
"""Of a preview that ends off the task's goal."""
OLD: Rgb = (140, 140, 140)
ACTIVE: Rgb = (255, 255, 255)
TARGET: Rgb = (226, 232, 240)
STROKE: Rgb = (148, 163, 184)
WATER: Rgb = (13, 34, 43)
WATER_ABOVE: Rgb = (36, 82, 96)
CURRENT_STROKE: Rgb = (255, 255, 255)


def component_colour(phase: float) -> Rgb:
    """Return a component's colour by when it is visited in the motion: one hue, from 0 (dark) to 1 (pale)."""
    light = 0.34 + 0.46 * min(max(phase, 0.0), 1.0)
    red, green, blue = colorsys.hls_to_rgb(0.475, light, 0.55)
    return round(255 * red), round(255 * green), round(255 * blue)


def mixed(colour: Rgb, other: Rgb, part: float) -> Rgb:
    """Mix a part of another colour into a colour."""
    red, green, blue = (round((1.0 - part) * a + part * b) for a, b in zip(colour, other, strict=True))
    return red, green, blue


def many(colours: Sequence[Rgb]) -> NDArray[np.uint8]:
    """Return the colours of the parts of one node: viser takes these as linear light, single colours as sRGB.

    Returns:
        Shape (N, 3).
    """
    return np.round(255.0 * (np.array(colours).reshape(-1, 3) / 255.0) ** 2.2).astype(np.uint8)


def css(colour: Rgb) -> str:
    """Format a colour for HTML."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
