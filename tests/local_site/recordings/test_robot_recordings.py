"""Binary recordings of robots and data sets: imported right, or refused in one line with a remedy."""

# pyright: reportMissingImports=false
from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin

from farhand.common.errors import InvalidDemonstration
from farhand.local_site.recordings import reader_process
from tests.local_site.recordings.foreign import (
    CHAIN,
    NAMED,
    POSES,
    SOCKET,
    STILL,
    TYPES,
    bag,
    by_hand,
    cut,
    lerobot,
    pose,
    robomimic,
)
from tests.local_site.recordings.truth import POSITIONS_M, TIMES_S, N, assert_true, read, words

RIGHT: dict[str, tuple[Callable[[Path], Path], dict[str, Any]]] = {
    "rosbag2, sqlite3": (lambda folder: bag(folder / "bag", POSES), {}),
    "rosbag2, MCAP": (lambda folder: bag(folder / "bag", POSES, StoragePlugin.MCAP), {}),
    "the file of a bag": (lambda folder: next(bag(folder / "bag", POSES).glob("*.db3")), {}),
    "MCAP by hand, compressed": (lambda folder: by_hand(folder / "by_hand.mcap", compress=True), {}),
    "MCAP by hand, plain": (lambda folder: by_hand(folder / "by_hand.mcap", compress=False), {}),
    "one topic of two": (
        lambda folder: bag(folder / "bag", [*POSES, *(("/other", t, pose(t, (0, 0, 0), STILL)) for t in TIMES_S)]),
        {"motion": "/plug/pose"},
    ),
    "LeRobot, names in a list": (lambda folder: lerobot(folder / "set", NAMED), {"only": (0,)}),
    "LeRobot, names in a group": (lambda folder: lerobot(folder / "set", {"motors": NAMED}), {"only": (0,)}),
    "LeRobot, by number": (
        lambda folder: lerobot(folder / "set", None),
        {"only": (0,), "columns": tuple(f"{role}=observation.state[{n}]" for n, role in enumerate(NAMED))},
    ),
    "robomimic": (lambda folder: robomimic(folder / "demo.hdf5"), {"only": (0,)}),
    "robomimic without a rate": (
        lambda folder: robomimic(folder / "demo.hdf5", rate_hz=None), {"only": (0,), "rate_hz": 20.0},
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", RIGHT)
def test_it_is_imported_with_the_values_computed_by_hand(kind: str, tmp_path: Path):
    make, options = RIGHT[kind]
    (understood,) = read(make(tmp_path), **options)
    assert_true(understood, tolerance=1e-7)


REFUSED: dict[str, tuple[Callable[[Path], Path], dict[str, Any], str]] = {
    "a bag without poses": (
        lambda folder: bag(folder / "bag", [("/say", 0.0, TYPES["std_msgs/msg/String"]("hello"))]),
        {}, r"a topic with PoseStamped.*/say \(std_msgs/msg/String\)",
    ),
    "two topics": (
        lambda folder: bag(folder / "bag", [*POSES, ("/b", 0.0, pose(0.0, (0, 0, 0), STILL))]),
        {}, r"one body that moves, got '/plug/pose', '/b': choose with --motion",
    ),
    "a frame in another world": (
        lambda folder: bag(folder / "bag", [*POSES, *(("/b", t, pose(t, (0, 0, 0), STILL, "camera")) for t in TIMES_S)]),
        {"frames": ("goal=/b",)}, r"/b in the frame of the motion, 'world', but it is in 'camera': record the transforms",
    ),
    "a frame that was seen later": (
        lambda folder: bag(folder / "bag", [*POSES, *(("/b", t, pose(t + 2.0, (t, 0, 0), STILL)) for t in TIMES_S)]),
        {"frames": ("goal=/b",)}, r"--frames: /b to be recorded during the whole motion, .*--frames NAME=X,Y,Z",
    ),
    "a cut MCAP": (lambda folder: cut(by_hand(folder / "cut.mcap", compress=True)), {}, r"a whole rosbag2 folder, .db3 or .mcap file; `mcap recover`"),
    "an MCAP without its end": (
        lambda folder: by_hand(folder / "open.mcap", compress=False, ending=False), {}, r"a whole rosbag2 folder, .db3 or .mcap",
    ),
    "a bag of ROS 1": (lambda folder: folder / "old.bag", {}, r"kind: .*ROS 1: rosbags-convert"),
    "joints of LeRobot": (
        lambda folder: lerobot(folder / "set", [f"joint_{n}.pos" for n in range(7)]),
        {}, r"header: columns with the position of a body, got 'observation.state.joint_0.pos'.*--columns",
    ),
    "an open order": (
        lambda folder: lerobot(folder / "set", ["x", "y", "z", "q0", "q1", "q2", "q3"]),
        {}, r"recording 0, header: the order of the quaternion.*--quaternion-order",
    ),
    "an older LeRobot": (lambda folder: lerobot(folder / "set", NAMED, "v2.1"), {}, r"got 'v2.1': convert it with lerobot"),
    "an episode that is not there": (lambda folder: lerobot(folder / "set", NAMED), {"only": (9,)}, r"--only: numbers of its recordings"),
    "a cut parquet": (
        lambda folder: cut(next(lerobot(folder / "set", NAMED).glob("data/*/*.parquet"))).parents[2],
        {}, r"a whole LeRobot v3.0 data set",
    ),
    "one parquet file": (lambda folder: folder / "file-000.parquet", {}, r"the folder of the data set"),
    "an empty folder": (lambda folder: folder, {}, r"metadata.yaml.*meta/info.json"),
    "robomimic without a rate": (
        lambda folder: robomimic(folder / "demo.hdf5", rate_hz=None), {}, r"recording 0, header: a column of times.*--rate-hz",
    ),
    "robomimic of several lengths": (
        lambda folder: robomimic(folder / "demo.hdf5", object=np.zeros((N + 1, 3))), {}, r"data of one length in demo_0",
    ),
    "robomimic with another file in it": (
        lambda folder: robomimic(
            folder / "demo.hdf5",
            robot1_eef_pos=h5py.ExternalLink(str(robomimic(folder / "other.hdf5")), "/data/demo_0/obs/robot0_eef_pos"),
        ),
        {"motion": "robot1_eef"}, r"--motion: one of 'robot0_eef', got 'robot1_eef'",
    ),
    "a cut HDF5": (lambda folder: cut(robomimic(folder / "demo.hdf5")), {}, r"a whole HDF5 file of robomimic"),
}  # fmt: skip


@pytest.mark.parametrize("kind", REFUSED)
def test_it_is_refused_in_one_line_with_a_remedy(kind: str, tmp_path: Path):
    make, options, expected = REFUSED[kind]
    file = make(tmp_path)
    with pytest.raises(InvalidDemonstration, match=expected) as caught:
        read(file, **options)
    assert str(caught.value).startswith(f"{file}: ") and "\n" not in str(caught.value)


def test_a_task_frame_comes_from_tf_and_the_motion_is_seen_from_it(tmp_path: Path):
    again = [("/tf_static", 0.4, message) for _, _, message in SOCKET]  # for those who start later
    file = bag(tmp_path / "bag", [*SOCKET, *POSES, *again])
    (understood,) = read(file, motion="/plug/pose", frames=("receptacle=socket",))
    made = understood.demonstration
    assert_true(understood, tolerance=1e-7)
    assert made.frame_names == ("receptacle",) and not made.frames_move
    # Half a turn about z: x and y are seen from the other side.
    expected = [(0.2 - p[0], 0.2 - p[1], p[2] - 0.1) for p in POSITIONS_M]
    np.testing.assert_allclose(made.in_frame(), expected, atol=1e-9)


def test_a_body_is_followed_through_the_frames_that_carry_it(tmp_path: Path):
    (understood,) = read(bag(tmp_path / "bag", CHAIN), motion="tool")
    made = understood.demonstration
    np.testing.assert_allclose(made.position_m, POSITIONS_M, atol=1e-7)
    assert made.quat_wxyz is not None
    np.testing.assert_allclose(np.abs(made.quat_wxyz[:, 0]), 1.0, atol=1e-9)  # two half turns
    assert words(understood, "within") == "hand in base in world"
    with pytest.raises(InvalidDemonstration, match="'base', 'hand', 'tool': choose with --motion"):
        read(tmp_path / "bag")


def test_all_episodes_are_imported_unless_some_are_chosen(tmp_path: Path):
    found = read(lerobot(tmp_path / "set", NAMED))
    assert [understood.number for understood in found] == [0, 1, 2]
    starts = [understood.demonstration.position_m[0, 0] for understood in found]
    np.testing.assert_allclose(starts, [0.1, 1.1, 2.1], atol=1e-7)
    assert [understood.number for understood in read(robomimic(tmp_path / "demo.hdf5"))] == [0, 1]


EXTRAS = {"rosbags": ("bag", "rosbag"), "pyarrow": ("lerobot", "lerobot"), "h5py": ("robomimic", "robomimic")}


@pytest.mark.parametrize("package", EXTRAS)
def test_a_package_that_is_not_installed_is_named_with_the_command_that_installs_it(
    package: str, tmp_path: Path
):
    kind, extra = EXTRAS[package]
    code = (
        f"import runpy, sys; sys.modules[{package!r}] = None; sys.argv = ['reader', {kind!r}, {str(tmp_path)!r}]; "
        f"runpy.run_path({reader_process.__file__!r}, run_name='__main__')"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == f"the package {package} is not installed: pip install 'farhand[{extra}]'\n"
