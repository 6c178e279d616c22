from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.teaching.recording import RawRecording

FRAME = TaskFrame(np.array([[0.0, -1.0], [1.0, 0.0]]), np.array([0.7, 0.3]))


def follow(recording: RawRecording, n: int, period_s: float = 0.1) -> tuple[list[np.ndarray], list[float]]:
    """Record n samples, one after the other."""
    recording.begin([FRAME])
    points: list[np.ndarray] = []
    times: list[float] = []
    for k in range(n):
        points.append(np.array([0.01 * k, 0.5]))
        times.append(7.0 + period_s * k)
        recording.follow(points, times)
    return points, times


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "planar" / "under-way.jsonl"


def test_all_but_the_last_second_is_there_for_a_later_process(path: Path):
    points, times = follow(RawRecording(path, Manifold(2), ("goal",)), 96)
    found = RawRecording(path, Manifold(2), ("goal",)).left_over()
    assert found is not None
    n = len(found.time_s)
    assert times[-1] - times[n - 1] <= 1.0
    np.testing.assert_array_equal(found.position_m, points[:n])
    np.testing.assert_array_equal(found.time_s, times[:n])


def test_what_was_ended_or_undone_leaves_nothing(path: Path):
    recording = RawRecording(path, Manifold(2), ("goal",))
    follow(recording, 30)
    recording.forget()
    assert recording.left_over() is None and not path.exists()
    recording.forget()


def test_what_is_set_aside_is_there_to_its_last_sample(path: Path):
    recording = RawRecording(path, Manifold(2), ("goal",))
    points, times = follow(recording, 35)
    kept = recording.set_aside(points, times)
    assert kept is not None
    np.testing.assert_array_equal(kept.position_m, points)
    found = RawRecording(path, Manifold(2), ("goal",)).left_over()
    assert found is not None and len(found.time_s) == 35


def test_a_new_demonstration_is_written_over_what_was_left(path: Path):
    recording = RawRecording(path, Manifold(2), ("goal",))
    points, times = follow(recording, 35)
    recording.set_aside(points, times)
    follow(recording, 11)
    found = recording.left_over()
    assert found is not None and len(found.time_s) == 11


def test_a_line_that_the_crash_cut_short_ends_it(path: Path):
    follow(RawRecording(path, Manifold(2), ("goal",)), 31)
    path.write_bytes(path.read_bytes()[:-7])
    found = RawRecording(path, Manifold(2), ("goal",)).left_over()
    assert found is not None and len(found.time_s) == 30


WITHIN = b'{"frame_origin_m":[[0.7,0.3]],"frame_rotation":[[[1.0,0.0],[0.0,1.0]]]}\n'


@pytest.mark.parametrize(
    "content",
    [
        b"", b"{}\n", b"\xff\n", b"[1.0,0.1,0.2]\n[1.1,0.1,0.2]\n", WITHIN, WITHIN + b"[1.0,0.1,0.2]\n",
        WITHIN + b"[1,2,3,4]\n[2,3,4,5]\n", WITHIN + b"[2,2,3]\n[1,2,3]\n", WITHIN.replace(b"0.7,0.3", b"0.7") + b"[1,2,3]\n[2,2,3]\n",
    ],
)  # fmt: skip
def test_what_is_no_motion_is_not_offered(path: Path, content: bytes):
    path.parent.mkdir()
    path.write_bytes(content)
    assert RawRecording(path, Manifold(2), ("goal",)).left_over() is None


def test_a_disk_that_is_gone_is_said_and_does_not_end_the_demonstration(tmp_path: Path, caplog):
    (tmp_path / "file").write_text("")
    recording = RawRecording(tmp_path / "file" / "under-way.jsonl", Manifold(2), ("goal",))
    points, times = follow(recording, 30)
    assert "could not be written" in caplog.text
    assert recording.set_aside(points, times) is None


def test_poses_and_their_frames_are_there_again(path: Path):
    recording = RawRecording(path, POSE, ("receptacle",))
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    recording.begin([TaskFrame(turned, np.array([0.8, 0.1, 0.4]))])
    points = [np.array([0.1 * k, 0.0, 0.3, np.cos(0.1 * k), np.sin(0.1 * k), 0.0, 0.0]) for k in range(5)]
    found = recording.set_aside(points, [0.01 * k for k in range(5)])
    assert found is not None and found.frame_names == ("receptacle",)
    np.testing.assert_array_equal(found.points, points)
    np.testing.assert_array_equal(found.frames_at(0)[0].A, turned)
    np.testing.assert_array_equal(found.frames_at(0)[0].b, [0.8, 0.1, 0.4])
