from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from farhand.common.errors import InvalidMessage
from farhand.common.model.manifold import Manifold
from farhand.common.wire.messages import Stamp
from farhand.common.wire.motion_encoding import RecordedMotion, packed_row
from tests.strategies import frame_counts, random_frame, random_points, seeds, spaces

STAMP = Stamp("boot", 5)


def a_motion(
    space: Manifold, n_frames: int, n: int = 4, seed: int = 0, step_s: float = 0.01
) -> tuple[RecordedMotion, np.ndarray, list]:
    rng = np.random.default_rng(seed)
    points = random_points(rng, space, n)
    frames = [[random_frame(rng, space.n_dims) for _ in range(n_frames)] for _ in range(n)]
    rows = b"".join(packed_row(step_s * k, points[k], frames[k]) for k in range(n))
    names = tuple(f"frame {j}" for j in range(n_frames))
    motion = RecordedMotion(
        task="task", frame_names=names, n_dims=space.n_dims, oriented=space.oriented, began=STAMP, rows=rows
    )
    return motion, points, frames


@settings(deadline=None, derandomize=True, max_examples=40)
@given(spaces, frame_counts, seeds)
def test_points_and_frames_come_back_in_single_precision(space: Manifold, n_frames: int, seed: int):
    motion, points, frames = a_motion(space, n_frames, seed=seed)
    again = RecordedMotion.from_bytes(motion.content)
    assert again == motion and again.space == space
    time_s, came, origins, rotations = again.samples()
    np.testing.assert_allclose(time_s, 0.01 * np.arange(4), atol=1e-7)
    np.testing.assert_allclose(came, points, rtol=2e-7, atol=2e-7)
    for t, there in enumerate(frames):
        np.testing.assert_allclose(origins[t], [frame.b for frame in there], rtol=1e-6)
        np.testing.assert_allclose(rotations[t], [frame.A for frame in there], atol=1e-6)
    turned = rotations @ np.swapaxes(rotations, -1, -2)
    np.testing.assert_allclose(turned, np.broadcast_to(np.eye(space.n_dims), turned.shape), atol=1e-12)


def test_a_gap_or_a_time_that_stands_still_is_no_motion():
    for step_s in (0.11, 0.0, -0.01):
        motion, _, _ = a_motion(Manifold(2), 1, step_s=step_s)
        with pytest.raises(InvalidMessage, match="times that increase"):
            motion.samples()
    assert len(a_motion(Manifold(2), 1, step_s=0.1)[0].samples().time_s) == 4


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (b"1234567", "whole rows"),
        (np.full(6, np.nan, "<f4").tobytes(), "finite"),
        (np.zeros(15, "<f4").tobytes(), "unit quaternions"),
    ],
)
def test_malformed_rows_are_refused(rows: bytes, words: str):
    space = Manifold(3, oriented=True) if words.startswith("unit") else Manifold(2)
    motion, _, _ = a_motion(space, 1)
    with pytest.raises(InvalidMessage, match=words):
        structs.replace(motion, rows=rows).samples()


@settings(deadline=None, derandomize=True, max_examples=60)
@given(st.binary(max_size=80))
def test_other_bytes_are_refused(data: bytes):
    with pytest.raises(InvalidMessage):
        RecordedMotion.from_bytes(data)
