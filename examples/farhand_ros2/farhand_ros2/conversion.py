"""Conversions between ROS messages and Farhand's conventions: joint order, wrench on the tool, task frames.

They need the messages' fields only, and no ROS.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand import TaskFrame

from .options import Pose, rotation

Array = NDArray[np.float64]


class JointStates(NamedTuple):
    """Joints in the order of the robot's file."""

    angles_rad: Array
    velocities: Array


class JointOrder:
    """Order of the joints in the messages.

    Args:
        joints: Names in ROS, in the order of the robot's file.
        command_joints: The same names in the order of the controller.

    Raises:
        ValueError: When the two do not have the same names, or one comes twice.
    """

    def __init__(self, joints: Sequence[str], command_joints: Sequence[str] = ()):
        self._joints, commanded = list(joints), list(command_joints or joints)
        if len(set(joints)) != len(joints) or sorted(commanded) != sorted(joints):
            raise ValueError(f"command_joints: each of {self._joints} once, got {commanded}")
        self._to_controller = [self._joints.index(name) for name in commanded]

    def read(self, message: Any) -> JointStates | None:
        """Return the joints of a `JointState`; None if it is about other joints, such as a gripper's.

        Raises:
            ValueError: When it has some of the joints only, or lacks positions, velocities or finite numbers.
        """
        index = {name: n for n, name in enumerate(message.name)}
        missing = [name for name in self._joints if name not in index]
        if len(missing) == len(self._joints):
            return None
        if missing:
            raise ValueError(f"no {', '.join(missing)} among its joints {list(message.name)}")
        for field in ("position", "velocity"):
            if len(getattr(message, field)) != len(index):
                raise ValueError(
                    f"{len(getattr(message, field))} numbers in `{field}` for {len(index)} joints"
                )
        order = [index[name] for name in self._joints]
        states = JointStates(np.array(message.position)[order], np.array(message.velocity)[order])
        return JointStates(*(_finite(numbers, "joints") for numbers in states))

    def command(self, joint_velocities: Array) -> list[float]:
        """Return joint velocities in the order of the controller. Shape (N,) [rad/s]."""
        return [float(joint_velocities[n]) for n in self._to_controller]


def wrench_on_tool(message: Any, sensor: Pose, on_tool: bool) -> Array:
    """Return the force and the torque about the wrist, on the tool and in its axes. Shape (6,) [N, Nm].

    Args:
        message: A `WrenchStamped`.
        sensor: Pose of the sensor's frame in the wrist's.
        on_tool: True if it measures the force on the tool, False for the opposite one.

    Raises:
        ValueError: When a number is not finite.
    """
    force, torque = message.wrench.force, message.wrench.torque
    told = np.array([[force.x, force.y, force.z], [torque.x, torque.y, torque.z]])
    force_n, torque_nm = (1.0 if on_tool else -1.0) * told @ sensor.axes.T
    return _finite(np.concatenate([force_n, torque_nm + np.cross(sensor.position_m, force_n)]), "wrench")


def task_frame(message: Any, frame: Pose, frame_id: str = "") -> TaskFrame:
    """Return a pose as a task frame in the robot file's world.

    Args:
        message: A `PoseStamped`.
        frame: Pose of the message's frame in that world.
        frame_id: Name that the message's frame must have; empty for any.

    Raises:
        ValueError: When it is told in another frame, or a number is impossible.
    """
    if frame_id and message.header.frame_id != frame_id:
        raise ValueError(f"a pose in the frame {frame_id!r}, got one in {message.header.frame_id!r}")
    return in_world(pose_frame(message.pose.position, message.pose.orientation), frame)


def in_world(seen: TaskFrame, frame: Pose) -> TaskFrame:
    """Return a task frame in the robot file's world, from where it is in a frame whose pose there is given."""
    return TaskFrame(frame.axes @ seen.A, frame.axes @ seen.b + frame.position_m)


def pose_frame(at: Any, turn: Any) -> TaskFrame:
    """Return a position and a quaternion of ROS as a task frame.

    Raises:
        ValueError: When a number is impossible.
    """
    origin_m = _finite(np.array([at.x, at.y, at.z]), "position")
    return TaskFrame(rotation(np.array([turn.w, turn.x, turn.y, turn.z])), origin_m)


def _finite(numbers: Array, what: str) -> Array:
    if not np.isfinite(numbers).all():
        raise ValueError(f"{what}: finite numbers only, got {numbers.tolist()}")
    return numbers
