from __future__ import annotations

import numpy as np
import pytest

from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.interface.plant import PointPlant
from farhand.remote_site.interface.sensing import PREDICTED_S, Sensing, apart


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
    np.testing.assert_array_equal(sensing.mean_frames()[0].b, [1.0, 0.0])
    for n in range(2, 301):
        sensing.update(0.1 * n)
    np.testing.assert_allclose(sensing.mean_frames()[0].b, [np.arange(201, 301).mean(), 0.0])
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


class Hidden:
    """A target that goes along x at a steady speed and can be hidden."""

    def __init__(self) -> None:
        self.seen, self.jump_m = True, 0.0

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        origin = np.array([0.1 * now_s + self.jump_m, 0.0])
        return [TaskFrame(np.eye(2), origin)] if self.seen else None

    def true_origin_m(self, now_s: float) -> None:
        return None


def looking(target: Hidden) -> Sensing:
    plant = PointPlant(np.zeros(2), np.ones(2), 1.0, 1.0)
    sensing = Sensing(plant, target, n_frames=1, control_hz=100.0, now_s=0.0)
    for n in range(1, 101):
        sensing.update(0.01 * n)
    return sensing


def test_what_is_not_seen_goes_on_as_it_went_for_three_tenths_of_a_second_and_then_stands():
    target = Hidden()
    sensing = looking(target)
    target.seen = False
    for n in range(101, 201):
        sensing.update(0.01 * n)
        expected = 0.1 * min(0.01 * n, 1.0 + PREDICTED_S)
        np.testing.assert_allclose(sensing.frames[0].b, [expected, 0.0], atol=1e-9)
        assert sensing.unseen_s == pytest.approx(0.01 * n - 1.0)


class Turning:
    """A receptacle that goes along x and turns about z at steady speeds and can be hidden."""

    def __init__(self) -> None:
        self.seen = True

    def pose(self, now_s: float) -> np.ndarray:
        return np.array([0.1 * now_s, 0.0, 0.4, np.cos(0.1 * now_s), 0.0, 0.0, np.sin(0.1 * now_s)])

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        return [TaskFrame.at(self.pose(now_s))] if self.seen else None

    def true_origin_m(self, now_s: float) -> None:
        return None


def test_a_pose_that_is_not_seen_goes_on_turning_as_long_as_it_goes_on_moving():
    target = Turning()
    plant = PointPlant(np.zeros(3), np.ones(3), 1.0, 1.0)
    sensing = Sensing(plant, target, n_frames=1, control_hz=100.0, now_s=0.0)
    for n in range(1, 101):
        sensing.update(0.01 * n)
    target.seen = False
    for n in range(101, 201):
        sensing.update(0.01 * n)
        expected = TaskFrame.at(target.pose(min(0.01 * n, 1.0 + PREDICTED_S)))
        np.testing.assert_allclose(sensing.frames[0].b, expected.b, atol=1e-9)
        np.testing.assert_allclose(sensing.frames[0].A, expected.A, atol=1e-9)
    target.seen = True
    sensing.update(2.01)
    again = sensing.seen_again
    assert again is not None
    assert again.turned_rad == pytest.approx(0.2 * 0.71) and again.moved_m == pytest.approx(0.071)


def test_the_mean_of_a_frame_that_turns_to_and_fro_is_in_between():
    class Rocking(Turning):
        def pose(self, now_s: float) -> np.ndarray:
            angle = 0.2 * np.sin(2.0 * np.pi * now_s)
            return np.array([0.0, 0.0, 0.4, np.cos(0.5 * angle), np.sin(0.5 * angle), 0.0, 0.0])

    plant = PointPlant(np.zeros(3), np.ones(3), 1.0, 1.0)
    sensing = Sensing(plant, Rocking(), n_frames=1, control_hz=100.0, now_s=0.0)
    for n in range(1, 1001):
        sensing.update(0.01 * n)
    np.testing.assert_allclose(sensing.mean_frames()[0].A, np.eye(3), atol=1e-3)
    assert apart(sensing.mean_frames()[0], TaskFrame.at(Rocking().pose(0.25))) == pytest.approx(
        (0.0, 0.2), abs=1e-3
    )


def test_how_a_frame_went_before_a_gap_does_not_count_after_it():
    target = Hidden()
    sensing = looking(target)
    target.seen = False
    sensing.update(2.0)
    target.seen, target.jump_m = True, 0.5
    sensing.update(3.0)
    target.seen = False
    sensing.update(3.2)
    np.testing.assert_allclose(sensing.frames[0].b, [0.8, 0.0])


def test_what_is_seen_again_tells_the_gap_and_how_far_off_it_was_once():
    target = Hidden()
    sensing = looking(target)
    target.seen = False
    sensing.update(1.1)
    target.seen, target.jump_m = True, 0.03
    sensing.update(1.2)
    again = sensing.seen_again
    assert again is not None
    # The prediction of the last look without sight, at 1.1 s, is what it is compared with.
    assert (again.gap_s, again.moved_m) == (pytest.approx(0.2), pytest.approx(0.04))
    assert sensing.unseen_s == 0.0
    sensing.update(1.21)
    assert sensing.seen_again is None


def test_before_anything_was_seen_nothing_is_known_for_ever():
    target = Hidden()
    target.seen = False
    plant = PointPlant(np.zeros(2), np.ones(2), 1.0, 1.0)
    sensing = Sensing(plant, target, n_frames=1, control_hz=100.0, now_s=0.0)
    sensing.update(1.0)
    assert sensing.unseen_s == np.inf
    target.seen = True
    sensing.update(2.0)
    assert sensing.unseen_s == 0.0 and sensing.seen_again is None
