"""Expected present pose of the robot.

It is the committed path at (stamp + time since receipt + half the round trip).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.control_mode import ControlMode
from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import PlannedPath, Telemetry
from farhand.common.wire.motion_encoding import points_of
from farhand.local_site.console.console_state import ConsoleState

Array = NDArray[np.float64]


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


def _pose(position_m: tuple[float, ...], rotation_rad: tuple[float, ...]) -> Array:
    turn = Rotation.from_rotvec(rotation_rad or (0.0, 0.0, 0.0)).as_quat(scalar_first=True)
    return np.concatenate([position_m, turn])
