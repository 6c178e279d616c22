"""Goal of a task as far as the operator's site knows it: the miss of a motion's end, and motions seen from the goal."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.task import AnyTask, PointTask
from farhand.local_site.teaching.demonstration import Demonstration

Array = NDArray[np.float64]

_DEEP_M, _BESIDE_M, _ASKEW_RAD = 0.060, 0.010, math.radians(12.0)
"""A plug is in the receptacle from this depth on, at most so far beside the axis and so askew [m, rad]."""
_OUT_M = 0.005
"""A plug is out of the receptacle from this distance before the mouth on [m]."""
_PART = 0.06
"""A point is at its target within this share of the workspace."""


def goal_miss(task: AnyTask, point: Array) -> str:
    """Return how a motion that ends at a point misses the task's goal, in words; empty if it reaches the goal.

    Args:
        task: Task.
        point: End of the motion in the last task frame: a position [m], or a pose of the plug's tip. Shape (C,).
    """
    if isinstance(task, PointTask):
        away_m = float(np.linalg.norm(point[: task.n_dims]))
        return f"{_mm(away_m)} from the target" if away_m > _PART * max(task.workspace_m) else ""
    depth_m, beside_m = float(point[2]), float(np.hypot(point[0], point[1]))
    if task.skill == "extract":
        inside = depth_m > -_OUT_M and beside_m < _BESIDE_M
        return f"{_mm(max(depth_m, 0.0))} deep, still in the receptacle" if inside else ""
    axis = Rotation.from_quat(point[3:], scalar_first=True).as_matrix()[:, 2]
    tilt_rad = math.acos(min(max(float(axis[2]), -1.0), 1.0))
    parts = []
    if depth_m < _DEEP_M:
        parts.append(
            f"{_mm(-depth_m)} before the receptacle" if depth_m < 0.0 else f"only {_mm(depth_m)} deep"
        )
    elif beside_m > _BESIDE_M:
        parts.append(f"{_mm(depth_m)} past the mouth")
    if beside_m > _BESIDE_M:
        parts.append(f"{_mm(beside_m)} beside the bore")
    if tilt_rad > _ASKEW_RAD:
        parts.append(f"{math.degrees(tilt_rad):.0f}° askew")
    return " and ".join(parts)


def _mm(length_m: float) -> str:
    return f"{1e3 * length_m:.0f} mm"


@lru_cache(maxsize=64)
def seen_from_goal(demonstration: Demonstration) -> Array:
    """Return a motion's points as if the goal's frame had been at its last place all along.

    Shape (T, C). Orientations are those of the world.
    """
    points = demonstration.points
    if not demonstration.frames_move:
        return points
    A = np.broadcast_to(demonstration.frame_rotation, (*_moving(demonstration), demonstration.n_dims))[:, -1]
    b = np.broadcast_to(demonstration.frame_origin_m, _moving(demonstration))[:, -1]
    local = np.einsum("tji,tj->ti", A, demonstration.position_m - b)
    return np.hstack([local @ A[-1].T + b[-1], points[:, demonstration.n_dims :]])


def _moving(demonstration: Demonstration) -> tuple[int, int, int]:
    """Return the shape of origins that are given for every sample."""
    return demonstration.time_s.size, len(demonstration.frame_names), demonstration.n_dims
