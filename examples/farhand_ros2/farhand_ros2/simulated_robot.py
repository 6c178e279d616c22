"""A robot to try the drivers with: Farhand's simulated arm behind the ROS 2 topics of ros2_control.

It publishes joint states, the wrench and the receptacle's pose, and obeys velocity commands for 0.1 s each, in real
time. Words on its standard input: `silence` and `speak` end and begin its messages, `truth` prints what the simulation
knows, `quit` ends it.

    python -m farhand_ros2.simulated_robot --robot jaco
"""

# pyright: reportMissingImports=false

from __future__ import annotations

import json
import os
import queue
import stat
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import tyro
from geometry_msgs.msg import PoseStamped, WrenchStamped
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from farhand.common.arm.simulation.disturbances import CALM, Disturbances
from farhand.common.arm.simulation.simulation import TICK_S, Simulation
from farhand.common.arm.simulation.starts_and_goals import Box, Placement, Seated
from farhand.common.clock import Rate
from farhand.common.model.manifold import POSE
from farhand.common.task import ArmTask
from farhand.deploy.places import find_cell, find_task
from farhand.remote_site.perception.simulated_sight import MarkerTracker, TrackerNoise
from farhand.remote_site.robots.arm_plant import SimulatedJoints
from farhand.remote_site.robots.simulated_environment import SimulatedEnvironment

from .node import RosNode, Topic, end_asked
from .options import ArmOptions, NodeOptions, TrackerOptions

Array = NDArray[np.float64]

_VALID_S = 0.1
_MOST_AT_ONCE = 5
_NOISE = TrackerNoise(jitter_m=TrackerOptions().noise_m, jitter_rad=TrackerOptions().noise_rad)
_MOVES_RAD_S = 1e-6


@dataclass(frozen=True)
class Settings:
    """Simulated robot behind ROS 2 topics."""

    robot: str = ""
    """Name of a robot that comes with Farhand, or a robot file; jaco when not given."""
    task: str = "hot-stab"
    """Task of an arm, which decides where the plug is at first."""
    seed: int = 0
    """Seed of the places of arm and receptacle."""
    domain_id: int | None = None
    """ROS domain; ROS_DOMAIN_ID when not given."""


class Machine:
    """Arm in front of its receptacle, with what its controller has been told.

    Args:
        settings: Robot, task, seed.
    """

    def __init__(self, settings: Settings):
        task = find_task(settings.task)
        cell = find_cell(task, settings.robot)
        assert isinstance(task, ArmTask) and cell is not None
        box, random = Box.of(cell.robot), np.random.default_rng([settings.seed, 1])
        place = Placement.sample if task.skill == "insert" else Placement.seated
        first = place(random, box, cell)
        around = SimulatedEnvironment(first.receptacle, Disturbances(CALM, settings.seed), box)
        self.physics, self.joints = Simulation(cell), cell.robot.joints
        self._driver = SimulatedJoints(self.physics, around, first.joints_rad)
        self._tracker = MarkerTracker(POSE, _NOISE, settings.seed)
        self._told, self._told_s = np.zeros(len(self.joints)), -np.inf
        self._began_s = time.monotonic()
        self.moved_s = -np.inf
        """Time at which the last command to move arrived [s]."""
        self.n_moves = 0
        """Number of commands to move so far."""

    def take(self, message: Any) -> bool:
        """Take a command, in the node's thread."""
        told, now_s = np.array(message.data), time.monotonic()
        if told.shape != (len(self.joints),):
            raise ValueError(f"{len(self.joints)} velocities, got {told.size}")
        if np.abs(told).max() > _MOVES_RAD_S:
            self.moved_s, self.n_moves = now_s, self.n_moves + 1
        self._told, self._told_s = told, now_s
        return True

    def keep_up(self) -> None:
        """Simulate the control periods that have passed, with the newest command, or with zeros if it is old."""
        now_s = time.monotonic()
        command = self._told if now_s - self._told_s < _VALID_S else np.zeros(len(self.joints))
        passed = int((now_s - self._began_s - self._driver.time_s) / TICK_S)
        if passed > _MOST_AT_ONCE:  # this machine stood still: so does the robot
            self._began_s += (passed - _MOST_AT_ONCE) * TICK_S
        for _ in range(min(passed, _MOST_AT_ONCE)):
            self._driver.command(command, TICK_S)

    def measure(self) -> tuple[Array, Array, Array]:
        """Return angles, velocities and the wrench."""
        reading = self._driver.read()
        return reading.joints_rad, reading.joint_velocities, reading.wrench

    def look(self) -> list[Array]:
        """Return the tracker's new measurements of the receptacle. Shape (7,) each."""
        return [found.point for found in self._tracker.look(self.physics.mouth, self._driver.time_s)]

    def truth(self) -> dict[str, Any]:
        """Return what only a simulation knows."""
        plug = self.physics.insertion
        local = np.array([plug.lateral_m, 0.0, plug.depth_m])
        return {
            "depth_m": plug.depth_m,
            "lateral_m": plug.lateral_m,
            "seated": Seated().reached(local, 0.0, self.physics),
            "fastest_rad_s": float(np.abs(self.physics.joint_velocities).max()),
            "commanded_rad_s": float(np.abs(self._told).max()),
            "commands_to_move": self.n_moves,
        }


class Publishers:
    """The robot's messages.

    Args:
        node: Node of the robot.
        joints: Names of the joints.
    """

    def __init__(self, node: RosNode, joints: Sequence[str]):
        # As a broadcaster may: in an order of its own, with joints that are nobody's business.
        self._node, self._names = node, [*reversed(joints), "finger"]
        self._states = node.publisher(JointState, ArmOptions().joint_states)
        self._wrench = node.publisher(WrenchStamped, ArmOptions().wrench)
        self._pose = node.publisher(PoseStamped, TrackerOptions().poses[0])

    def tell(self, angles_rad: Array, velocities: Array, wrench: Array, poses: Sequence[Array]) -> None:
        """Publish the measurements of one control period."""
        states = JointState(name=self._names, position=[*angles_rad[::-1].tolist(), 0.0])
        states.velocity = [*velocities[::-1].tolist(), 0.0]
        states.header.stamp = now = self._node.now()
        self._states.publish(states)
        felt = WrenchStamped()
        felt.header.stamp, felt.header.frame_id = now, "wrist"
        felt.wrench.force.x, felt.wrench.force.y, felt.wrench.force.z = wrench[:3].tolist()
        felt.wrench.torque.x, felt.wrench.torque.y, felt.wrench.torque.z = wrench[3:].tolist()
        self._wrench.publish(felt)
        for seen in poses:
            pose = PoseStamped()
            pose.header.stamp, pose.header.frame_id = now, "world"
            at, turn = pose.pose.position, pose.pose.orientation
            at.x, at.y, at.z, turn.w, turn.x, turn.y, turn.z = seen.tolist()
            self._pose.publish(pose)


class SimulatedRobot:
    """The machine behind its topics, in real time.

    Args:
        settings: Robot, task, seed, domain.
        end: Event that ends it.
    """

    def __init__(self, settings: Settings, end: threading.Event):
        self._machine = machine = Machine(settings)
        self._node = RosNode(
            "simulated_robot", NodeOptions(domain_id=settings.domain_id, reliability="reliable")
        )
        self._publishers = Publishers(self._node, machine.joints)
        self._commands = Topic[bool](ArmOptions().commands, machine.take)
        self._node.subscribe(Float64MultiArray, self._commands)
        self._asked: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._end, self._speaks, self._told_s = end, True, 0.0

    def ask(self, word: str) -> None:
        """Have a word of the standard input obeyed, between two control periods; from any thread."""
        self._asked.put(word)

    def run(self) -> None:
        """Move and tell until the end is asked for."""
        self._node.serve()
        try:
            rate = Rate(TICK_S, self._end)
            _say({"ready": True})
            while rate.wait():
                self._machine.keep_up()
                while not self._asked.empty():
                    self._obey(self._asked.get())
                if self._speaks:
                    self._publishers.tell(*self._machine.measure(), self._machine.look())
                    self._told_s = time.monotonic()
        finally:
            self._node.close()

    def _obey(self, word: str) -> None:
        if word == "quit":
            self._end.set()
        elif word in ("silence", "speak"):
            self._speaks = word == "speak"
            _say(self._machine.truth())
        elif word == "truth":
            # How long after the newest message the last command to move came.
            moved_for_s = self._machine.moved_s - self._told_s
            _say({**self._machine.truth(), "moved_for_s": moved_for_s, "complaint": self._commands.complaint})
        else:
            _say({"unknown": word})


def _say(fact: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(fact) + "\n")
    sys.stdout.flush()


def _listen(robot: SimulatedRobot) -> None:
    for line in sys.stdin:
        robot.ask(line.strip())
    if stat.S_ISFIFO(os.fstat(sys.stdin.fileno()).st_mode):
        robot.ask("quit")  # who asked is gone


def main() -> None:
    """Run the robot until `quit` or Ctrl-C."""
    robot = SimulatedRobot(tyro.cli(Settings, description=__doc__), end_asked())
    threading.Thread(target=_listen, args=(robot,), daemon=True).start()
    robot.run()


if __name__ == "__main__":
    main()
