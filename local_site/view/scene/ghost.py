"""Expected present pose of the robot.

It is the committed path at (stamp + time since receipt + half the round trip).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.mode_table import ControlMode
from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import PlannedPath, Telemetry
from farhand.common.wire.motion_encoding import points_of
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.report_age import LinkHealth
from farhand.local_site.teaching.goal import goal_miss
from farhand.local_site.view.panels.words.controls import BEFORE_THE_END, scene_name

Array = NDArray[np.float64]

_MOST_POINTS = 200
"""Largest number of points of a path in a message."""
_UNMOVED_M = 2e-3


@dataclass(frozen=True)
class Ghost:
    """Prediction at one moment.

    Args:
        point: Point in the task frame: a position (D,) [m] or a pose (7,).
        left_s: Time to the end of the path [s]; not positive beyond it.
        done: True at the end of the path: the motion is expected to have ended.
        robot_s: Time for which it is expected, on the robot's clock [s].
    """

    point: Array
    left_s: float
    done: bool
    robot_s: float = 0.0


def shown_path(state: ConsoleState) -> PlannedPath | None:
    """Return the path to draw: the committed one during an execution, also a paused one, a valid preview in HOLD."""
    path, robot = state.path, state.robot
    if path is None or robot is None or path.stamp.boot != robot.stamp.boot:
        return None
    if state.mode in (ControlMode.AUTONOMOUS, ControlMode.PAUSED):
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
    """Content of the robot's half of the scene.

    Args:
        state: State of the console; its robot is that of an earlier moment while the operator looks back.
        now_s: Present time on the console's clock [s].
        then_s: Time of the shown moment on the console's clock [s]; None for the present.
        trace: Where the robot went in its newest execution, in the task frame. Shape (n, D) [m]; None without one.
        ghost: The robot's expected present pose; None without an execution.
        error_m: Distance of an earlier expectation from what the robot has reported since [m]; None without one.
        played: Point of the preview that is played, in the task frame. Shape (C,); None without a preview.
        miss: How the preview misses the task's goal, in words; empty if it reaches the goal.
    """

    state: ConsoleState
    now_s: float
    then_s: float | None = None
    trace: Array | None = None
    ghost: Ghost | None = None
    error_m: float | None = None
    played: Array | None = None
    miss: str = ""

    @property
    def old(self) -> bool:
        """True if the robot was reported too long ago, or is shown as it was."""
        return self.state.link.health is not LinkHealth.OK

    @property
    def hand(self) -> Array | None:
        """Point at which the ghost is drawn: expected, or of the preview. Shape (C,); None for no ghost."""
        return self.played if self.ghost is None else self.ghost.point

    def name(self, name: str) -> str:
        """Return the robot's name in the scene, with the age of what is drawn when that is old."""
        age_s = self.state.link.age_s
        if self.then_s is not None:
            return scene_name(name, self.now_s - self.then_s, past=True)
        if not self.old or age_s is None:
            return name
        return scene_name(name, age_s + self.now_s - self.state.now_s, past=False)


def is_cut(path: PlannedPath) -> bool:
    """Decide whether a path is the beginning of a longer motion than a message carries."""
    return not path.reaches_end and len(points_of(path)) >= _MOST_POINTS


def preview_miss(state: ConsoleState) -> str:
    """Return how the shown preview misses the task's goal, in words; empty if it reaches the goal, or without one."""
    path = shown_path(state)
    if path is None or state.mode is not ControlMode.HOLD:
        return ""
    if is_cut(path):
        return ""  # nobody knows yet where it ends
    if not path.reaches_end:
        return BEFORE_THE_END
    return goal_miss(state.task, points_of(path)[-1])


def along(points: Array, at: float) -> Array:
    """Return a point of a path between its rows. Shape (C,).

    Args:
        points: Positions [m] or poses. Shape (n, C).
        at: Number of the row, with a fraction; cut to the path's ends.
    """
    last = len(points) - 1
    low = int(np.clip(np.floor(at), 0, last))
    high, part = min(low + 1, last), float(np.clip(at - low, 0.0, 1.0))
    space = POSE if points.shape[1] == POSE.n_coordinates else Manifold(points.shape[1])
    return space.exp(points[low], part * space.log(points[low], points[high]))


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
    return Ghost(along(points, at), (last - at) * path.step_s, done=at >= last, robot_s=robot_now_s)


class PredictionCheck:
    """Comparison of the ghost with the truth, once the robot has reported where it was then. Used by the page's thread."""

    def __init__(self) -> None:
        self._expected: deque[tuple[float, Array]] = deque(maxlen=600)
        self._checked_s = float("-inf")
        self.error_m: float | None = None
        """Distance between the newest report and what was expected for its time [m]; None without an execution."""

    def update(self, robot: Telemetry | None, ghost: Ghost | None) -> None:
        """Note an expectation, and compare a new report with the ones for its time."""
        if ghost is None or robot is None:
            self._expected.clear()
            self.error_m = None
            return
        if not self._expected or ghost.robot_s > self._expected[-1][0]:
            n_dims = min(len(ghost.point), 3)
            self._expected.append((ghost.robot_s, ghost.point[:n_dims]))
        at_s = robot.stamp.t_ns * 1e-9
        if at_s != self._checked_s and self._expected[0][0] <= at_s <= self._expected[-1][0]:
            self._checked_s = at_s
            times_s, points = (np.array(each) for each in zip(*self._expected, strict=True))
            expected = [np.interp(at_s, times_s, axis) for axis in points.T]
            self.error_m = float(np.linalg.norm(tip_in_frame(robot)[: len(expected)] - expected))
            while len(self._expected) > 1 and self._expected[1][0] <= at_s:
                self._expected.popleft()  # reports come in their order: nothing asks for earlier times


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
