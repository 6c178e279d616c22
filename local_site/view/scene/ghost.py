"""Expected present pose of the robot.

It is the committed path at (stamp + time since receipt + half the round trip).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.control_mode import ControlMode
from farhand.common.link.link_monitor import LinkHealth
from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import PlannedPath, Telemetry
from farhand.common.wire.motion_encoding import points_of
from farhand.local_site.console.console_state import ConsoleState

Array = NDArray[np.float64]

_UNMOVED_M = 2e-3


@dataclass(frozen=True)
class Ghost:
    """Prediction at one moment.

    Args:
        point: Point in the task frame: a position (D,) [m] or a pose (7,).
        left_s: Time to the end of the path [s]; not positive beyond it.
        done: True at the end of the path: the motion is expected to have ended.
    """

    point: Array
    left_s: float
    done: bool


def shown_path(state: ConsoleState) -> PlannedPath | None:
    """Return the path to draw: the committed one during an execution, a valid preview in HOLD."""
    path, robot = state.path, state.robot
    if path is None or robot is None or path.stamp.boot != robot.stamp.boot:
        return None
    if state.mode is ControlMode.AUTONOMOUS:
        return path
    previewed = path.plan_id and path.plan_id == state.plan_id
    return path if state.mode is ControlMode.HOLD and previewed else None


def shown_points(state: ConsoleState) -> Array | None:
    """Return the points of the path to draw, in the task frame; None without one. Shape (n, C).

    A preview begins where the robot stands, however its target has moved since, and ends at the target.
    """
    path, robot = shown_path(state), state.robot
    if path is None or robot is None:
        return None
    points = points_of(path)
    if state.mode is not ControlMode.HOLD or len(points) < 2:
        return points
    n_dims = min(points.shape[1], 3)
    steps_m = np.linalg.norm(np.diff(points[:, :n_dims], axis=0), axis=1)
    left = 1.0 - np.concatenate([[0.0], np.cumsum(steps_m)]) / max(float(steps_m.sum()), 1e-9)
    anchored = points.copy()
    anchored[:, :n_dims] += left[:, None] * (tip_in_frame(robot)[:n_dims] - points[0, :n_dims])
    return anchored


def unmoved(before: Array | None, after: Array | None) -> bool:
    """Decide whether two curves look alike, so that the later one need not be sent."""
    if before is None or after is None:
        return before is after
    return before.shape == after.shape and float(np.abs(before - after).max()) < _UNMOVED_M


@dataclass(frozen=True, eq=False)
class RobotPicture:
    """What the robot's half of the scene shows.

    Args:
        state: State of the console; its robot is that of an earlier moment while the operator looks back.
        now_s: Present time on the console's clock [s].
        then_s: Time of the shown moment on the console's clock [s]; None for the present.
        trace: Where the robot went in its newest execution, in the task frame. Shape (n, D) [m]; None without one.
    """

    state: ConsoleState
    now_s: float
    then_s: float | None = None
    trace: Array | None = None

    @property
    def old(self) -> bool:
        """True if the robot was reported too long ago, or is shown as it was."""
        return self.state.link.health is not LinkHealth.OK

    def name(self, name: str) -> str:
        """Return the robot's name in the scene, with the age of what is drawn when that is old."""
        age_s = self.state.link.age_s
        if self.then_s is not None:
            return f"{name}, {round(self.now_s - self.then_s)} s ago, not now"
        if not self.old or age_s is None:
            return name
        return f"{name}, {math.floor(age_s + self.now_s - self.state.now_s)} s ago"

    def prediction(self) -> Ghost | None:
        """Return the robot's expected present pose; None without an execution, and for a moment of the past."""
        return None if self.then_s is not None else predict(self.state, self.now_s)


def predict(state: ConsoleState, now_s: float) -> Ghost | None:
    """Predict the robot's present pose from its committed path; None without an execution.

    Args:
        state: Present state of the console.
        now_s: Present time on the console's clock [s].
    """
    path, robot = shown_path(state), state.robot
    if path is None or robot is None or state.mode is not ControlMode.AUTONOMOUS or path.plan_id:
        return None
    since_receipt_s = state.link.silent_s + now_s - state.now_s
    robot_now_s = robot.stamp.t_ns * 1e-9 + since_receipt_s + 0.5 * (state.link.round_trip_s or 0.0)
    points = points_of(path)
    at = (robot_now_s - path.stamp.t_ns * 1e-9) / path.step_s
    last = len(points) - 1
    low = int(np.clip(np.floor(at), 0, last))
    high = min(low + 1, last)
    part = float(np.clip(at - low, 0.0, 1.0))
    space = POSE if points.shape[1] == POSE.n_coordinates else Manifold(points.shape[1])
    point = space.exp(points[low], part * space.log(points[low], points[high]))
    return Ghost(point, (last - at) * path.step_s, done=at >= last)


def reported_frame(robot: Telemetry) -> Array:
    """Return the task frame as the robot sees it, as a pose. Shape (7,)."""
    return _pose(robot.frame_origin_m, robot.frame_rotation_rad)


def reported_tip(robot: Telemetry) -> Array:
    """Return the tip of the robot's tool in the task frame, as a pose. Shape (7,)."""
    turn = robot.arm.rotation_rad if robot.arm is not UNSET else (0.0, 0.0, 0.0)
    return TaskFrame.at(reported_frame(robot)).to_local(_pose(robot.position_m, turn))


def tip_in_frame(robot: Telemetry) -> Array:
    """Return where the robot is in the task frame: the position of its point, or of its tool's tip. Shape (>= D,) [m]."""
    if robot.arm is not UNSET or len(robot.position_m) == 3:
        return reported_tip(robot)
    angle = robot.frame_rotation_rad[0] if robot.frame_rotation_rad else 0.0
    x, y = np.subtract(robot.position_m, robot.frame_origin_m)
    return np.array([math.cos(angle) * x + math.sin(angle) * y, math.cos(angle) * y - math.sin(angle) * x])


def _pose(position_m: tuple[float, ...], rotation_rad: tuple[float, ...]) -> Array:
    turn = Rotation.from_rotvec(rotation_rad or (0.0, 0.0, 0.0)).as_quat(scalar_first=True)
    return np.concatenate([position_m, turn])
