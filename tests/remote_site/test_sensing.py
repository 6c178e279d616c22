from __future__ import annotations

import numpy as np

from common.task_frame import TaskFrame
from remote_site.plant import PointPlant
from remote_site.sensing import Sensing


class Steps:
    """A target that is one metre further with every look."""

    def __init__(self) -> None:
        self.looks = 0

    def observe(self, now_s: float) -> list[TaskFrame]:
        self.looks += 1
        return [TaskFrame(np.eye(2), np.array([float(self.looks), 0.0]))]

    def true_origin_m(self, now_s: float) -> None:
        return None


def test_the_mean_frame_is_over_the_last_ten_seconds():
    sensing = Sensing(
        PointPlant(np.zeros(2), np.ones(2), 1.0, 1.0), Steps(), n_frames=1, control_hz=10.0, now_s=0.0
    )
    np.testing.assert_array_equal(sensing.mean_frame_m(), [1.0, 0.0])
    for n in range(2, 301):
        sensing.update(0.1 * n)
    np.testing.assert_allclose(sensing.mean_frame_m(), [np.arange(201, 301).mean(), 0.0])
    np.testing.assert_array_equal(sensing.frames[0].b, [300.0, 0.0])


def test_what_was_measured_does_not_change_when_the_robot_moves_on():
    plant = PointPlant(np.array([0.5, 0.5]), np.ones(2), 1.0, 1.0)
    sensing = Sensing(plant, Steps(), n_frames=1, control_hz=10.0, now_s=0.0)
    measured = sensing.effector
    for _ in range(10):
        plant.accelerate(np.array([1.0, 0.0]), 0.1)
    np.testing.assert_array_equal(measured.position_m, [0.5, 0.5])
    sensing.update(1.0)
    assert sensing.effector.position_m[0] > 0.8
