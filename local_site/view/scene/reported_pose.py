"""The poses in a robot's report."""

from __future__ import annotations

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import Telemetry

Array = NDArray[np.float64]


def reported_frame(robot: Telemetry) -> Array:
    """The task frame as the robot sees it. A pose. Shape (7,)."""
    return _pose(robot.frame_origin_m, robot.frame_rotation_rad)


def reported_tip(robot: Telemetry) -> Array:
    """The tip of the robot's tool, in the task frame. A pose. Shape (7,)."""
    turn = robot.arm.rotation_rad if robot.arm is not UNSET else (0.0, 0.0, 0.0)
    return TaskFrame.at(reported_frame(robot)).to_local(_pose(robot.position_m, turn))


def _pose(position_m: tuple[float, ...], rotation_rad: tuple[float, ...]) -> Array:
    turn = Rotation.from_rotvec(rotation_rad or (0.0, 0.0, 0.0)).as_quat(scalar_first=True)
    return np.concatenate([position_m, turn])
