"""Camera whose pictures the operator sees; your own camera needs one class with one method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput
from farhand.common.model.manifold import POSE

Array = NDArray[np.float64]

MOST_PIXELS = 4096
_LEAST_PIXELS = 16


@dataclass(frozen=True, eq=False)
class CameraView:
    """Place of a camera, and its focal length: a pinhole whose optical axis meets the middle of the image.

    Args:
        pose: Pose of the camera from the arm's base; its axes lead to the right, down and forwards. Shape (7,).
        focal_px: Focal length in pixels of the image.
    """

    pose: Array
    focal_px: float


@dataclass(frozen=True, eq=False)
class CameraImage:
    """Image of a camera.

    Args:
        pixels: Red, green and blue. Shape (height, width, 3), uint8.
        view: Place and focal length; None where nobody knows them. Then the whole image is sent, and the predicted tool
            is not drawn in it.
        age_s: Time since the exposure [s].
    """

    pixels: NDArray[np.uint8]
    view: CameraView | None = None
    age_s: float = 0.0


class Camera(Protocol):
    """Interface of a camera; it runs in a process of its own, which may wait, crash or hang without any effect on the robot.

    What it may have besides: `Startable`, `Closable`.
    """

    def capture(self) -> CameraImage | None:
        """Take an image, within 5 s; None while there is none. What it raises is told on the page."""
        ...


@runtime_checkable
class SceneCamera(Protocol):
    """Camera of a simulation, which must be told what it sees before it captures."""

    def show(self, joints_rad: Array, receptacle: Array) -> None:
        """Take the state of the scene.

        Args:
            joints_rad: Joint angles of the arm. Shape (N,) [rad].
            receptacle: True pose of the receptacle from the arm's base. Shape (7,).
        """
        ...


def check_image(image: Any) -> None:
    """Check what a camera returned.

    Raises:
        InvalidInput: When it is no `CameraImage`, its pixels have another shape or type, its view is no pose or has no
            focal length, or its age is not finite.
    """
    if not isinstance(image, CameraImage):
        raise InvalidInput("camera", "capture", f"a CameraImage or None, got {type(image).__name__}")
    pixels = image.pixels
    if not isinstance(pixels, np.ndarray) or pixels.dtype != np.uint8 or pixels.ndim != 3:
        found = (
            f"{pixels.dtype} of shape {pixels.shape}"
            if isinstance(pixels, np.ndarray)
            else type(pixels).__name__
        )
        raise InvalidInput("camera", "capture: pixels", f"uint8 of shape (height, width, 3), got {found}")
    height, width, colours = pixels.shape
    if colours != 3 or not all(_LEAST_PIXELS <= n <= MOST_PIXELS for n in (height, width)):
        expected = (
            f"3 colours, width and height from {_LEAST_PIXELS} to {MOST_PIXELS}, got shape {pixels.shape}"
        )
        raise InvalidInput("camera", "capture: pixels", expected)
    if not (isinstance(image.age_s, int | float) and 0.0 <= image.age_s < 1e6):
        raise InvalidInput("camera", "capture: age_s", f"seconds, zero or more, got {image.age_s!r}")
    if image.view is not None:
        POSE.checked(image.view.pose, "camera", "capture: view.pose")
        if not 0.0 < image.view.focal_px < 1e6:
            raise InvalidInput(
                "camera", "capture: view.focal_px", f"a positive number, got {image.view.focal_px!r}"
            )
