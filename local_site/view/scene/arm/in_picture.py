"""Places in a picture of the robot's camera: what is known in space is projected into it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from farhand.common.errors import InvalidInput
from farhand.common.model.manifold import POSE
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import PictureView
from farhand.common.wire.scene_description import SceneDescription

Array = NDArray[np.float64]

_NEAREST_M = 0.02
_AXIS_M = 0.06
"""Length of the axis that is drawn ahead of the tool's tip [m]."""


def project(view: PictureView, points_m: Array) -> Array | None:
    """Project points into a picture; None if one of them is behind the camera, or the view is none.

    Args:
        view: Camera that took the picture.
        points_m: Points from the arm's base. Shape (N, 3) [m].

    Returns:
        Shape (N, 2) [px].
    """
    try:
        pose = POSE.checked(view.pose, "picture", "view.pose")
    except InvalidInput:
        return None
    camera = TaskFrame.at(pose)
    seen = (points_m - camera.b) @ camera.A
    if (seen[:, 2] < _NEAREST_M).any():
        return None
    return np.array(view.centre_px) + view.focal_px * seen[:, :2] / seen[:, 2:]


def tool_outline(view: PictureView, robot: SceneDescription, tip: Array) -> tuple[Array, Array] | None:
    """Return the outline of what the tool holds, and the axis ahead of its tip, as they would be in a picture.

    Args:
        view: Camera that took the picture.
        robot: Drawing of the robot.
        tip: Pose of the tool's tip from the arm's base. Shape (7,).

    Returns:
        Outline, shape (N, 2), and axis, shape (2, 2) [px]; None where nothing can be drawn.
    """
    if not robot.held:
        return None
    tool = TaskFrame.at(robot.tool_at(tip))
    corners = np.concatenate([mesh.vertices_m for mesh in robot.held]) @ tool.A.T + tool.b
    ahead = TaskFrame.at(tip).to_world(np.array([0.0, 0.0, _AXIS_M, 1.0, 0.0, 0.0, 0.0]))
    points = project(view, np.vstack([corners, tip[None, :3], ahead[None, :3]]))
    if points is None:
        return None
    try:
        hull = ConvexHull(points[:-2]).vertices
    except QhullError:  # seen edgewise
        return None
    return points[hull], points[-2:]
