"""The controller's kinematics agree with the physics and with finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.arm.kinematics import Kinematics, difference
from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.simulation import Simulation
from tests.cells import JACO

HOME = np.array(JACO.robot.home_rad)


@pytest.fixture(scope="module")
def kinematics() -> Kinematics:
    return Kinematics(JACO)


@pytest.mark.parametrize("seed", range(3))
def test_the_tip_is_where_the_physics_has_it(kinematics: Kinematics, seed: int):
    simulation = Simulation(JACO)
    joints = HOME + np.random.default_rng(seed).uniform(-0.4, 0.4, 6)
    simulation.reset(joints, Surroundings.still(JACO))
    kinematics.update(joints)
    assert np.abs(difference(simulation.tip, kinematics.tip)).max() < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_the_jacobian_is_that_of_finite_differences(kinematics: Kinematics, seed: int):
    joints = HOME + np.random.default_rng(seed).uniform(-0.4, 0.4, 6)
    kinematics.update(joints)
    J, h = kinematics.jacobian(), 1e-6
    for joint in range(6):
        step = h * np.eye(6)[joint]
        kinematics.update(joints - step)
        before = kinematics.tip
        kinematics.update(joints + step)
        assert difference(before, kinematics.tip) / (2 * h) == pytest.approx(J[:, joint], abs=1e-6)


def test_the_least_singular_value_vanishes_with_a_straight_wrist(kinematics: Kinematics):
    kinematics.update(HOME)
    assert kinematics.least_singular_value() == pytest.approx(0.061, abs=0.001)
    straight = HOME.copy()
    straight[4] = 0.0
    kinematics.update(straight)
    assert kinematics.least_singular_value() < 1e-3


def test_the_tool_weighs_hand_and_plug(kinematics: Kinematics):
    kinematics.update(HOME)
    mass_kg, centre_m = kinematics.tool_weight()
    assert mass_kg == pytest.approx(0.54719 + 3 * (0.0255204 + 0.0132655) + JACO.plug.mass_kg)
    assert np.hypot(*centre_m[:2]) < 5e-3
    assert 0.05 < centre_m[2] < JACO.plug.reach_m
