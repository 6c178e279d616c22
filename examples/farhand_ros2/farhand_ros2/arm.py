"""Arm behind ROS 2 topics: joint states and a wrench come in, joint velocities go out."""

# pyright: reportMissingImports=false

from __future__ import annotations

import threading
import time
from collections import deque
from typing import Any

import numpy as np
from geometry_msgs.msg import WrenchStamped
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from farhand import ArmReading

from .conversion import JointOrder, JointStates, wrench_on_tool
from .node import RosNode, Topic, await_all
from .options import ArmOptions, read_options

Array = NDArray[np.float64]

_WATCH_S = 0.02
_KEPT = 100  # wrenches between two readings: more only if nobody reads


class RosArm:
    """`ArmDriver` of an arm whose velocity controller listens to a topic.

    A command is valid for `valid_s`: then a timer of the node sends zeros, until the next command. While it has a fault,
    and after `halt`, it sends zeros whatever it is told.

    Args:
        robot: The robot's file.
        options: See `ArmOptions`.

    Raises:
        ValueError: When the names of the joints do not fit the robot.
    """

    def __init__(self, robot: Any, options: dict[str, Any]):
        self._options = read_options(ArmOptions, options)
        joints = self._options.joints or robot.joints
        if len(joints) != len(robot.joints):
            raise ValueError(f"joints: {len(robot.joints)} names, as {robot.name} has, got {list(joints)}")
        self._order = JointOrder(joints, self._options.command_joints)
        self._still = np.zeros(len(joints))
        self._states = Topic[JointStates](self._options.joint_states, self._order.read)
        self._wrench = Topic[Array](self._options.wrench, self._take_wrench)
        self._wrenches = deque[Array](maxlen=_KEPT)
        self._sending = threading.Lock()
        self._commanded_s = self._halted_s = -np.inf
        self._node: RosNode | None = None

    def start(self) -> None:
        """Join the domain, and wait until the robot speaks and listens.

        Raises:
            TimeoutError: When it does not; says what is missing.
        """
        options = self._options
        self._node = node = RosNode("farhand_arm", options)
        try:
            node.subscribe(JointState, self._states)
            node.subscribe(WrenchStamped, self._wrench)
            self._commands = node.publisher(Float64MultiArray, options.commands)
            node.every(_WATCH_S, self._watch)
            node.serve()
            await_all(self._missing, options.start_s)
        except BaseException:
            node.close()
            raise

    def close(self) -> None:
        """Send zeros, and leave the domain."""
        if self._node is not None:
            self.halt()
            self._node.close()

    @property
    def fault(self) -> str:
        """Fault in words: a silent topic, a message that cannot be used, a controller that is gone; empty for none."""
        if self._node is None or self._node.fault:
            return self._node.fault if self._node is not None else "it has not been started"
        if self._commands.get_subscription_count() == 0:
            return f"{self._options.commands}: no controller listens"
        silent_s = self._options.silent_s
        return self._states.fault(silent_s) or self._wrench.fault(silent_s)

    def read(self) -> ArmReading:
        """Return the newest joint states, and the mean of the wrenches since the last reading."""
        states, newest = self._states.newest, self._wrench.newest
        assert states is not None and newest is not None  # `start` has awaited them
        since = [self._wrenches.popleft() for _ in range(len(self._wrenches))]
        mean = np.mean(since, axis=0) if since else newest
        return ArmReading(states.angles_rad, states.velocities, mean)

    def command(self, joint_velocities: Array, dt_s: float) -> None:
        """Send joint velocities, in the order of the robot's file. Shape (N,) [rad/s]."""
        with self._sending:
            self._commanded_s = time.monotonic()
            halted = self._commanded_s - self._halted_s < self._options.valid_s
            self._send(self._still if halted or self.fault else joint_velocities)

    def halt(self) -> None:
        """Send zeros, and nothing else until this has not been called for `valid_s`."""
        with self._sending:
            self._halted_s = time.monotonic()
            self._send(self._still)

    def _watch(self) -> None:
        """Send zeros while Farhand is silent."""
        with self._sending:
            if self._options.valid_s < time.monotonic() - self._commanded_s < np.inf:
                self._send(self._still)

    def _send(self, joint_velocities: Array) -> None:
        self._commands.publish(Float64MultiArray(data=self._order.command(joint_velocities)))

    def _take_wrench(self, message: Any) -> Array:
        options = self._options
        taken = wrench_on_tool(message, options.sensor, options.sensor_measures == "on tool")
        self._wrenches.append(taken)
        return taken

    def _missing(self) -> list[str]:
        missing = [
            topic.complaint or f"{topic.name}: no message"
            for topic in (self._states, self._wrench)
            if topic.newest is None
        ]
        if self._commands.get_subscription_count() == 0:
            missing.append(f"{self._options.commands}: no controller that listens")
        return missing
