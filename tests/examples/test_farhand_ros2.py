"""What the ROS 2 drivers make of messages and options; against real topics: `test_ros2_job`."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from examples.farhand_ros2.farhand_ros2.conversion import JointOrder, task_frame, wrench_on_tool
from examples.farhand_ros2.farhand_ros2.options import (
    ArmOptions,
    NodeOptions,
    Pose,
    TrackerOptions,
    read_options,
)
from examples.farhand_ros2.farhand_ros2.transforms import Transforms
from farhand.remote_site.config import RemoteConfig

FOLDER = Path(__file__).parents[2] / "examples" / "farhand_ros2"
JOINTS = ("shoulder", "elbow", "wrist")
number = st.floats(-10.0, 10.0)
vector = st.tuples(number, number, number)
quaternion = st.tuples(number, number, number, number).filter(lambda q: np.linalg.norm(q) > 0.1)


def joint_state(names: list[str], position: list[float], velocity: list[float]) -> Any:
    return SimpleNamespace(name=names, position=position, velocity=velocity)


def wrench(force: np.ndarray, torque: np.ndarray) -> Any:
    parts = [SimpleNamespace(x=x, y=y, z=z) for x, y, z in (force, torque)]
    return SimpleNamespace(wrench=SimpleNamespace(force=parts[0], torque=parts[1]))


def pose(position: Any, quat_wxyz: Any, frame_id: str = "base_link") -> Any:
    (x, y, z), (w, qx, qy, qz) = position, quat_wxyz
    at, turn = SimpleNamespace(x=x, y=y, z=z), SimpleNamespace(w=w, x=qx, y=qy, z=qz)
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=frame_id), pose=SimpleNamespace(position=at, orientation=turn)
    )


@given(st.permutations([*JOINTS, "finger", "lid"]), st.permutations(JOINTS))
def test_joints_are_found_by_their_names_and_told_in_the_controllers_order(told: list, commanded: list):
    angles = {name: float(n) for n, name in enumerate(told)}
    order = JointOrder(JOINTS, commanded)
    read = order.read(joint_state(told, list(angles.values()), [-angles[name] for name in told]))
    assert read is not None
    np.testing.assert_array_equal(read.angles_rad, [angles[name] for name in JOINTS])
    np.testing.assert_array_equal(read.velocities, [-angles[name] for name in JOINTS])
    sent = dict(zip(commanded, order.command(np.array([1.0, 2.0, 3.0])), strict=True))
    assert [sent[name] for name in JOINTS] == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (joint_state(["elbow"], [0.0], [0.0]), r"no shoulder, wrist among its joints \['elbow'\]"),
        (joint_state(list(JOINTS), [0.0] * 3, []), "0 numbers in `velocity` for 3 joints"),
        (joint_state(list(JOINTS), [0.0] * 2, [0.0] * 3), "2 numbers in `position` for 3 joints"),
        (joint_state(list(JOINTS), [0.0, np.nan, 0.0], [0.0] * 3), "joints: finite numbers only"),
    ],
)
def test_a_joint_state_that_cannot_be_used_says_why(message: Any, words: str):
    with pytest.raises(ValueError, match=words):
        JointOrder(JOINTS).read(message)


def test_a_message_about_the_gripper_alone_is_none_of_ours():
    assert JointOrder(JOINTS).read(joint_state(["finger"], [0.1], [])) is None


@pytest.mark.parametrize("commanded", [("shoulder", "elbow"), ("shoulder", "elbow", "hand"), ("wrist",) * 3])
def test_a_controller_of_other_joints_is_refused(commanded: tuple[str, ...]):
    with pytest.raises(ValueError, match="command_joints: each of"):
        JointOrder(JOINTS, commanded)


@given(vector, vector, vector, quaternion, vector, vector, st.booleans())
def test_a_wrench_does_the_same_work_wherever_its_sensor_is(force, torque, at, turn, v, w, on_tool: bool):
    """The power of a wrench is the same in all frames of one body: an oracle that knows no lever."""
    axes = Rotation.from_quat(turn, scalar_first=True)
    there = wrench_on_tool(wrench(np.array(force), np.array(torque)), Pose(at, turn), on_tool)
    v_sensor = axes.inv().apply(np.add(v, np.cross(w, at)))
    power = np.dot(force, v_sensor) + np.dot(torque, axes.inv().apply(w))
    assert there @ np.concatenate([v, w]) == pytest.approx(power if on_tool else -power, abs=1e-7)


@settings(deadline=None)  # the first frame compiles
@given(vector, quaternion, vector, quaternion, vector)
def test_a_pose_is_a_task_frame_in_the_world_of_the_robots_file(position, turn, at, frame_turn, point):
    frame = task_frame(pose(position, turn), Pose(at, frame_turn))
    inner, outer = (Rotation.from_quat(q, scalar_first=True) for q in (turn, frame_turn))
    expected = outer.apply(inner.apply(point) + position) + at
    np.testing.assert_allclose(frame.A @ np.array(point) + frame.b, expected, atol=1e-9)


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (pose((0, 0, 0), (1, 0, 0, 0), "camera"), "a pose in the frame 'base_link', got one in 'camera'"),
        (pose((0, 0, 0), (0, 0, 0, 0)), "a quaternion of length 1"),
        (pose((0, 0, np.inf), (1, 0, 0, 0)), "position: finite numbers only"),
    ],
)
def test_a_pose_that_cannot_be_used_says_why(message: Any, words: str):
    with pytest.raises(ValueError, match=words):
        task_frame(message, Pose(), "base_link")


def tf(*edges: tuple[str, str, Any, Any]) -> Any:
    transforms = [
        SimpleNamespace(
            header=SimpleNamespace(frame_id=parent), child_frame_id=child,
            transform=SimpleNamespace(
                translation=SimpleNamespace(**dict(zip("xyz", position, strict=True))),
                rotation=SimpleNamespace(**dict(zip("wxyz", turn, strict=True))),
            ),
        )
        for parent, child, position, turn in edges
    ]  # fmt: skip
    return SimpleNamespace(transforms=transforms)


@settings(deadline=None)
@given(vector, quaternion, vector, quaternion, vector)
def test_a_frame_is_looked_up_through_those_between(at, turn, camera_at, camera_turn, point):
    tree = Transforms()
    assert tree.lookup("receptacle", "base_link") is None
    tree.take(tf(("/base_link", "camera", camera_at, camera_turn)), static=True)
    assert tree.lookup("receptacle", "base_link") is None
    tree.take(tf(("camera", "marker", at, turn), ("camera", "gripper", (0, 0, 0), (1, 0, 0, 0))))
    tree.take(tf(("marker", "receptacle", (0.1, 0.0, 0.0), (1, 0, 0, 0))), static=True)
    found = tree.lookup("receptacle", "base_link")
    assert found is not None
    inner, outer = (Rotation.from_quat(q, scalar_first=True) for q in (turn, camera_turn))
    expected = outer.apply(inner.apply(np.add(point, (0.1, 0.0, 0.0))) + at) + camera_at
    np.testing.assert_allclose(found[0].A @ np.array(point) + found[0].b, expected, atol=1e-9)


def test_a_frame_is_new_when_its_tracker_speaks_and_not_when_the_arm_below_its_camera_moves():
    tree, still = Transforms(), ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))

    def number() -> int:
        found = tree.lookup("receptacle", "base_link")
        assert found is not None
        return found[1]

    tree.take(tf(("base_link", "wrist", *still), ("wrist", "receptacle", *still)))
    first = number()
    tree.take(tf(("base_link", "wrist", (0.0, 0.0, 1.0), still[1])))
    assert number() == first > 0
    tree.take(tf(("wrist", "receptacle", *still)))
    assert number() > first
    tree.take(tf(("base_link", "receptacle", *still)), static=True)  # calibrated: it never changes
    assert number() == 0
    tree.take(tf(("receptacle", "base_link", *still)))
    assert tree.lookup("receptacle", "world") is None  # a loop
    with pytest.raises(ValueError, match="receptacle: a quaternion of length 1"):
        tree.take(
            tf(("base_link", "receptacle", still[0], (0.0, 0.0, 0.0, 0.0)), ("base_link", "other", *still))
        )
    assert tree.lookup("other", "base_link") is not None


def test_an_option_that_is_wrong_is_named():
    with pytest.raises(msgspec.ValidationError, match="jonts"):
        read_options(ArmOptions, {"jonts": ["a"]})
    with pytest.raises(msgspec.ValidationError, match=r"sensor\.pos_m"):
        read_options(ArmOptions, {"sensor": {"pos_m": [0.0, 0.0]}})


def test_the_page_about_extending_has_options_that_there_are():
    page = (FOLDER.parents[1] / "docs" / "extending.md").read_text(encoding="utf-8")
    (table,) = [text for text in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if '"ros2"' in text]
    site = msgspec.toml.decode(table, type=RemoteConfig)
    assert read_options(ArmOptions, site.arm_driver.options) != ArmOptions()
    assert read_options(TrackerOptions, site.perception.options) != TrackerOptions()


def test_the_page_and_the_file_of_the_site_name_every_option():
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    site = msgspec.toml.decode((FOLDER / "remote.toml").read_text(encoding="utf-8"), type=RemoteConfig)
    assert read_options(ArmOptions, site.arm_driver.options) == ArmOptions()
    assert read_options(TrackerOptions, site.perception.options) == TrackerOptions()
    rows = set(re.findall(r"^\| ([^|]+) \|", page, re.MULTILINE))
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    for kind in (NodeOptions, ArmOptions, TrackerOptions):
        assert set(kind.__struct_fields__) <= named
