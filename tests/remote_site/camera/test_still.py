"""A picture shows the receptacle, fits its size, and knows from where it was taken."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from farhand.common.arm.kinematics import compose, inverse
from farhand.remote_site.camera.still import Still, make_still, region_of_interest
from farhand.remote_site.interface.camera import CameraImage, CameraView

HEIGHT, WIDTH = 480, 640
FOCAL_PX = 500.0
AHEAD = np.array([0.0, 0.0, 0.6, 0.0, 1.0, 0.0, 0.0])
"""A receptacle that the camera looks into, 0.6 m in front of it: its z leads to the camera's eye and back."""


def view(pose: np.ndarray | None = None) -> CameraView:
    return CameraView(np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]) if pose is None else pose, FOCAL_PX)


def picture(still: Still) -> np.ndarray:
    return np.asarray(Image.open(BytesIO(still.jpeg)))


def noise(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, (HEIGHT, WIDTH, 3)).astype(np.uint8)


def projected(still: Still, point_m: np.ndarray) -> tuple[float, float]:
    assert still.view is not None
    local = compose(inverse(np.array(still.view.pose)), np.concatenate([point_m, [1.0, 0.0, 0.0, 0.0]]))
    u, v = still.view.centre_px
    return u + still.view.focal_px * local[0] / local[2], v + still.view.focal_px * local[1] / local[2]


@pytest.mark.parametrize("aside_m", [(0.0, 0.0), (0.15, 0.1), (-0.3, 0.2), (-0.05, -0.12)])
def test_a_point_in_space_is_in_the_picture_where_its_camera_says_it_is(aside_m: tuple[float, float]):
    """A white spot is drawn by the full image's pinhole, found again in the file by its own."""
    receptacle = AHEAD + np.array([*aside_m, 0.0, 0.0, 0.0, 0.0, 0.0])
    u, v = np.array(aside_m) * FOCAL_PX / 0.6 + (WIDTH / 2, HEIGHT / 2)
    pixels = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    pixels[round(v) - 4 : round(v) + 4, round(u) - 4 : round(u) + 4] = 255
    still = make_still(CameraImage(pixels, view()), receptacle, 8000)
    bright = np.argwhere(picture(still)[..., 0] > 128)
    assert len(bright), "the receptacle is in the region of interest"
    row, column = bright.mean(axis=0) + 0.5
    assert projected(still, receptacle[:3]) == pytest.approx((column, row), abs=1.0)


@given(most_bytes=st.integers(1000, 8000), seed=st.integers(0, 9))
@settings(deadline=None, derandomize=True, max_examples=15)
def test_even_noise_fits_into_any_size_that_a_link_is_given(most_bytes: int, seed: int):
    still = make_still(CameraImage(noise(seed)), None, most_bytes)
    assert len(still.jpeg) <= most_bytes
    assert picture(still).shape == (still.height_px, still.width_px, 3)


def test_more_bytes_make_a_better_picture():
    smooth = np.linspace(0, 255, HEIGHT * WIDTH * 3).reshape(HEIGHT, WIDTH, 3).astype(np.uint8)
    smooth[::16] = noise()[::16]
    sizes = [make_still(CameraImage(smooth), None, n).width_px for n in (1000, 3000, 8000)]
    assert sizes == sorted(sizes) and sizes[0] < sizes[-1] <= 320


@pytest.mark.parametrize(
    ("camera", "receptacle"),
    [(None, AHEAD), (view(), None), (view(), AHEAD * [1, 1, -1, 1, 1, 1, 1]), (view(), AHEAD + np.eye(7)[0] * 9)],
    ids=["camera unknown", "receptacle unknown", "behind the camera", "out of sight"],
)  # fmt: skip
def test_the_whole_image_is_shown_where_the_receptacle_is_not_known_to_be_in_it(
    camera: CameraView | None, receptacle: np.ndarray | None
):
    assert region_of_interest(WIDTH, HEIGHT, camera, receptacle) == (0, 0, WIDTH, HEIGHT)


@given(
    x=st.floats(-1, 1), y=st.floats(-1, 1), z=st.floats(0.01, 5),
    width=st.integers(16, 4096), height=st.integers(16, 4096), focal_px=st.floats(10, 5000),
)  # fmt: skip
@settings(deadline=None, derandomize=True, max_examples=200)
def test_the_region_is_a_part_of_any_image(
    x: float, y: float, z: float, width: int, height: int, focal_px: float
):
    camera = CameraView(np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), focal_px)
    left, top, wide, high = region_of_interest(width, height, camera, np.array([x, y, z, 1.0, 0.0, 0.0, 0.0]))
    assert 0 <= left <= left + wide <= width and 0 <= top <= top + high <= height
    assert wide > 0 and high > 0
