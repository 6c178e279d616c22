from __future__ import annotations

import numpy as np
import pytest
from msgspec import structs

from farhand.common.mode_table import Phase
from farhand.common.task import PointTask
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.motion.manoeuvre import Manoeuvre, Manoeuvres
from farhand.remote_site.robots.point_embodiment import point_embodiment
from tests.remote_site.bench import DT_S, FeelingPlant, Sight
from tests.remote_site.planar import TASK


class Robot:
    """A plant that feels, what it senses, and its manoeuvres."""

    def __init__(self, task: PointTask = TASK, turn_rad: float = 0.0):
        self.plant, sight = FeelingPlant(task), Sight(task)
        sight.turn_rad = turn_rad
        self.sensing = Sensing(self.plant, sight, 1, 1.0 / DT_S, 0.0)
        self.manoeuvres = Manoeuvres(point_embodiment(task, self.plant, sight), self.sensing)

    def run(self, manoeuvre: Manoeuvre, at_most_s: float = 20.0) -> float:
        """Do it to its end. Returns the time that it took [s]."""
        for tick in range(1, round(at_most_s / DT_S) + 1):
            if manoeuvre.step(self.plant, self.plant.read(), DT_S):
                return tick * DT_S
        raise AssertionError("it never ended")


def test_it_goes_straight_to_its_place_no_faster_than_half_the_tasks_speed():
    robot = Robot()
    manoeuvre = robot.manoeuvres.make(Phase.RETRACTING)
    start, goal = np.array(TASK.start_m), np.array(TASK.start_m) + TASK.retract_m
    while not manoeuvre.step(robot.plant, robot.plant.read(), DT_S):
        state = robot.plant.read()
        assert np.linalg.norm(state.velocity_m_s) <= 0.5 * TASK.limits.speed_m_s + 1e-9
        assert abs(np.linalg.det([state.position_m - start, goal - start])) < 1e-9
    assert manoeuvre.reached
    np.testing.assert_allclose(robot.plant.read().position_m, goal, atol=2e-3)


def test_retract_is_in_the_axes_of_the_task_frame():
    robot = Robot(turn_rad=np.pi / 2)
    robot.run(robot.manoeuvres.make(Phase.RETRACTING))
    np.testing.assert_allclose(robot.plant.read().position_m, [0.0, TASK.start_m[1]], atol=3e-3)


@pytest.mark.parametrize("ready_m", [None, (0.4, 0.6)])
def test_ready_is_where_the_task_says_or_else_where_it_starts(ready_m):
    robot = Robot(structs.replace(TASK, ready_m=ready_m))
    robot.plant.push_to((0.8, 0.2))
    robot.sensing.update(0.02)
    manoeuvre = robot.manoeuvres.make(Phase.GOING_TO_READY)
    robot.run(manoeuvre)
    assert manoeuvre.reached
    np.testing.assert_allclose(robot.plant.read().position_m, ready_m or TASK.start_m, atol=2e-3)


def test_backing_off_gives_way_to_the_force_by_two_centimetres():
    robot = Robot()
    robot.plant.push_to((0.5, 0.5))
    robot.plant.force_n = np.array([-180.0, 240.0])
    robot.sensing.update(0.02)
    manoeuvre = robot.manoeuvres.make(Phase.BACKING_OFF)
    assert robot.run(manoeuvre) <= 2.0
    np.testing.assert_allclose(robot.plant.read().position_m, [0.488, 0.516], atol=2e-3)


def test_backing_off_against_a_wall_ends_after_two_seconds():
    robot = Robot()
    robot.plant.push_to((0.5, 1.0))
    robot.plant.force_n = np.array([0.0, 300.0])  # pushes out of the workspace
    robot.sensing.update(0.02)
    manoeuvre = robot.manoeuvres.make(Phase.BACKING_OFF)
    assert robot.run(manoeuvre) == pytest.approx(2.0, abs=2 * DT_S)
    assert not manoeuvre.reached


def test_a_goal_is_in_the_workspace():
    robot = Robot(structs.replace(TASK, retract_m=(0.0, 5.0)))
    manoeuvre = robot.manoeuvres.make(Phase.RETRACTING)
    robot.run(manoeuvre)
    assert manoeuvre.reached
    np.testing.assert_allclose(robot.plant.read().position_m, [TASK.start_m[0], 1.0], atol=2e-3)


@pytest.mark.parametrize("phase", [Phase.NONE, Phase.APPROACHING, Phase.BACKING_OFF])
def test_what_is_no_manoeuvre_or_has_no_direction_is_refused(phase: Phase):
    robot = Robot()
    robot.plant.force_n = None
    robot.sensing.update(0.02)
    with pytest.raises(ValueError, match="no manoeuvre"):
        robot.manoeuvres.make(phase)
