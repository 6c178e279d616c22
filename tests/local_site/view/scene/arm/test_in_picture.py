"""What is drawn into a picture is where a camera with that view would see it."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.arm.simulation.description import describe
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import PictureView
from farhand.local_site.view.scene.arm.in_picture import project, tool_outline
from tests.cells import JACO

STRAIGHT = PictureView((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), 100.0, (160.0, 120.0))
"""At the base, looking along z: x to the right, y down."""
FROM_THE_SIDE = PictureView((0.5, -0.8, 0.4, 0.5**0.5, -(0.5**0.5), 0.0, 0.0), 300.0, (160.0, 120.0))
"""Looking along the base's y axis, its z axis upwards."""


def test_a_point_is_seen_as_by_similar_triangles():
    points = np.array([[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [0.0, -0.5, 1.0]])
    assert project(STRAIGHT, points) == pytest.approx(np.array([[160, 120], [210, 120], [160, 70]]))
    beside = project(FROM_THE_SIDE, np.array([[0.6, 0.2, 0.4], [0.5, 0.2, 0.5]]))
    assert beside == pytest.approx(np.array([[190, 120], [160, 90]]))


def test_what_is_behind_the_camera_and_a_view_that_is_none_draw_nothing():
    assert project(STRAIGHT, np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])) is None
    no_pose = PictureView((0.0,) * 7, 100.0, (160.0, 120.0))  # type: ignore[arg-type]
    assert project(no_pose, np.array([[0.0, 0.0, 1.0]])) is None


def test_the_outline_of_the_plug_ends_at_its_tip_and_the_axis_leads_on():
    robot = describe(JACO)
    tip = robot.tip_pose(robot.home_rad)
    outline = tool_outline(FROM_THE_SIDE, robot, tip)
    assert outline is not None
    hull, axis = outline
    (at, ahead) = axis
    assert project(FROM_THE_SIDE, tip[None, :3]) == pytest.approx(at[None])
    assert np.abs(hull - at).max(axis=1).min() < 8.0, "a corner of the plug is at its tip"
    forwards = (TaskFrame.at(tip).A[:, 2]) @ np.array([[1.0, 0.0], [0.0, 0.0], [0.0, -1.0]])
    assert (ahead - at) @ forwards > 0.0
    along = (hull - at) @ forwards / np.linalg.norm(forwards)
    assert along.max() < 5.0 and along.min() < -15.0, "and the plug is behind its tip"
