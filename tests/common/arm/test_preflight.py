"""The pre-flight lets through what the arm can do, and says why not otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.arm.kinematics import Kinematics, moved
from farhand.common.arm.preflight import REFUSED_BELOW, WARNED_BELOW, Preflight, Preflights
from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.wire.reason_words import sentence
from farhand.deploy.places import find_cell, find_task
from tests.cells import JACO

HOME = np.array(JACO.robot.home_rad)
FACING = Surroundings.still(JACO).receptacle
PREFLIGHTS = Preflights(Kinematics(JACO))


def receptacle(
    position_m: tuple[float, float, float], turn_rad: tuple[float, float, float] = (0, 0, 0)
) -> np.ndarray:
    at = np.concatenate([position_m, FACING[3:]])
    return moved(at, np.array([0.0, 0.0, 0.0, *turn_rad]))


def test_the_receptacle_in_front_of_the_arm_is_let_through():
    found = PREFLIGHTS.examine(HOME, FACING)
    assert found.refusal is None and found.warning is None
    assert found.least_singular_value == pytest.approx(0.063, abs=0.002)
    assert found.worst_m < 1e-6
    assert PREFLIGHTS.examine(HOME, FACING) == found


def test_a_receptacle_beyond_the_arms_reach_is_refused_with_the_distance():
    found = PREFLIGHTS.examine(HOME, receptacle((1.20, 0.0, 0.38)))
    assert "out of the arm's reach" in sentence(found.refusal)
    assert found.worst_m > 0.05
    assert found.warning is None


def test_most_of_the_acceptance_box_is_let_through_and_bad_corners_are_not():
    random = np.random.default_rng(5)
    found = []
    for _ in range(12):
        axis = random.normal(size=3)
        turn = np.radians(random.uniform(0.0, 15.0)) * axis / np.linalg.norm(axis)
        position = random.uniform([0.74, -0.10, 0.30], [0.82, 0.10, 0.45])
        found.append(PREFLIGHTS.examine(HOME, receptacle(tuple(position), tuple(turn))))
    assert sum(not one.refusal for one in found) >= 11
    assert all(one.worst_m < 1e-4 for one in found)


def turned(steps: int, about_z_rad: float) -> np.ndarray:
    """Poses that turn the tool at home about its axis, a twentieth of a radian at a time."""
    home = Kinematics(JACO)
    home.update(HOME)
    turns = np.linspace(0.0, about_z_rad, steps)
    return np.stack([moved(home.tip, np.array([0.0, 0.0, 0.0, 0.0, 0.0, turn])) for turn in turns])


def test_a_plan_that_the_joints_can_follow_is_let_through():
    assert PREFLIGHTS.follow(HOME, turned(40, 2.0), 0.1) is None


def test_a_plan_that_leads_out_of_reach_is_refused_with_how_far_the_arm_comes():
    away = np.stack(
        [moved(turned(1, 0.0)[0], np.array([0.0, 0.0, 0.01 * k, 0.0, 0.0, 0.0])) for k in range(80)]
    )
    assert (
        "after " in (said := sentence(PREFLIGHTS.follow(HOME, away, 0.1))) and "joints cannot follow" in said
    )


def test_a_plan_that_turns_a_joint_beyond_its_range_is_refused():
    panda = find_cell(find_task("hot-stab"), "panda")
    assert panda is not None
    home = np.array(panda.robot.home_rad)
    kinematics = Kinematics(panda)
    kinematics.update(home)
    round_the_axis = [
        moved(kinematics.tip, np.array([0.0, 0.0, 0.0, 0.0, 0.0, turn]))
        for turn in np.linspace(0.0, 5.5, 110)
    ]
    refusal = Preflights(kinematics).follow(home, np.stack(round_the_axis), 0.1)
    assert "joints cannot follow" in sentence(refusal)


@pytest.mark.parametrize(
    ("least", "refused", "warned"),
    [(REFUSED_BELOW - 1e-3, True, False), (WARNED_BELOW - 1e-3, False, True), (0.05, False, False)],
)
def test_a_nearly_straight_wrist_is_warned_of_and_a_straight_one_refused(
    least: float, refused: bool, warned: bool
):
    found = Preflight(least, 0.0, 0.0)
    assert (found.refusal is not None, found.warning is not None) == (refused, warned)
