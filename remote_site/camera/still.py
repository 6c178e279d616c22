"""Still picture of an image: the region of interest around the receptacle, as a JPEG file of limited size."""

from __future__ import annotations

from io import BytesIO
from typing import NamedTuple

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from farhand.common.arm.kinematics import compose, inverse
from farhand.common.wire.messages import PictureView
from farhand.remote_site.interface.camera import CameraImage, CameraView

Array = NDArray[np.float64]

_BEFORE_MOUTH = np.array([0.0, 0.0, -0.07, 1.0, 0.0, 0.0, 0.0])
"""Middle of the region of interest in the receptacle's axes: the last bit of the way in is seen as well."""
_REGION_M = 0.5
"""Width of the region of interest [m]."""
_NEAREST_M = 0.05
_LEAST_PX, _ASPECT = 160, 0.75
_QUALITIES = (
    *((320, quality) for quality in (60, 45, 35, 25)),
    *((240, quality) for quality in (45, 35, 25)),
    *((160, quality) for quality in (45, 35, 25, 15)),
    *((96, quality) for quality in (35, 15, 5)),
)
"""Longer side [px] and JPEG quality, the best first: a small clear picture is better than a large one of blocks."""


class Still(Struct, frozen=True, tag=True):
    """Picture of limited size.

    Args:
        jpeg: JPEG file.
        width_px: Width.
        height_px: Height.
        view: Camera that took it; None if unknown.
        age_s: Time since the exposure [s].
    """

    jpeg: bytes
    width_px: int
    height_px: int
    view: PictureView | None
    age_s: float


class Region(NamedTuple):
    """Part of an image [px]."""

    left: int
    top: int
    width: int
    height: int


def region_of_interest(width: int, height: int, view: CameraView | None, receptacle: Array | None) -> Region:
    """Return the part of an image that shows the receptacle; the whole image where that is unknown or out of sight.

    Args:
        width: Width of the image.
        height: Height of the image.
        view: Place of the camera; None if unknown.
        receptacle: Pose of the receptacle from the arm's base; None if unknown. Shape (7,).
    """
    whole = Region(0, 0, width, height)
    if view is None or receptacle is None:
        return whole
    x, y, z = compose(inverse(view.pose), compose(receptacle, _BEFORE_MOUTH))[:3]
    if z < _NEAREST_M:
        return whole
    centre = 0.5 * width + view.focal_px * x / z, 0.5 * height + view.focal_px * y / z
    if not (0.0 <= centre[0] < width and 0.0 <= centre[1] < height):
        return whole
    wanted = max(view.focal_px * _REGION_M / z, _LEAST_PX)
    wide = int(min(wanted, width, height / _ASPECT))
    high = int(_ASPECT * wide)
    left = min(max(round(centre[0] - 0.5 * wide), 0), width - wide)
    top = min(max(round(centre[1] - 0.5 * high), 0), height - high)
    return Region(left, top, wide, high)


def make_still(image: CameraImage, receptacle: Array | None, most_bytes: int) -> Still:
    """Cut the region of interest out of an image, and compress it as well as a size allows.

    Args:
        image: Checked image.
        receptacle: Pose of the receptacle from the arm's base; None if unknown. Shape (7,).
        most_bytes: Largest size of the file [B]; only an image that cannot be compressed exceeds it.
    """
    from PIL import Image  # the camera's own process alone needs it

    height, width = image.pixels.shape[:2]
    region = region_of_interest(width, height, image.view, receptacle)
    left, top, wide, high = region
    cut = Image.fromarray(np.ascontiguousarray(image.pixels[top : top + high, left : left + wide]))
    jpeg, size = b"", cut.size
    for longest, quality in _QUALITIES:
        scale = min(1.0, longest / max(wide, high))
        size = max(1, round(scale * wide)), max(1, round(scale * high))
        file = BytesIO()
        cut.resize(size, Image.Resampling.BOX).save(file, "JPEG", quality=quality, optimize=True)
        jpeg = file.getvalue()
        if len(jpeg) <= most_bytes:
            break
    return Still(jpeg, *size, _seen_from(image.view, (width, height), region, size), float(image.age_s))


def _seen_from(
    view: CameraView | None, whole: tuple[int, int], region: Region, size: tuple[int, int]
) -> PictureView | None:
    """Return the camera of a part of an image that was resized."""
    if view is None:
        return None
    scale_x, scale_y = size[0] / region.width, size[1] / region.height
    centre = (0.5 * whole[0] - region.left) * scale_x, (0.5 * whole[1] - region.top) * scale_y
    x, y, z, qw, qx, qy, qz = np.asarray(view.pose, dtype=float).tolist()
    return PictureView((x, y, z, qw, qx, qy, qz), float(view.focal_px * scale_x), centre)
