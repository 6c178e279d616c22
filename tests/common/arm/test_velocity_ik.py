"""Joint velocities for a twist, within the limits of joints, speeds and distances."""

from __future__ import annotations

import numpy as np
import pytest

from farhand.common.arm.cell import Cell
from farhand.common.arm.engine import mink
from farhand.common.arm.kinematics import Kinematics, difference
from farhand.common.arm.velocity_ik import VelocityIk, ramped
from farhand.deploy.places import find_robot
from tests.cells import JACO

HOME = np.array(JACO.robot.home_rad)


@pytest.fixture
def kinematics() -> Kinematics:
    return Kinematics(JACO)


def test_it_is_minks_solution_to_the_last_bit_whether_limits_are_near_or_not(kinematics: Kinematics):
    ik, random = VelocityIk(kinematics), np.random.default_rng(0)
    constrained = 0
    for _ in range(60):
        joints = HOME + random.uniform(-0.6, 0.6, 6)
        kinematics.update(joints)
        board = kinematics.tip
        board[:3] += random.normal(size=3) * 0.1
        kinematics.place_panel(board if random.random() < 0.7 else None)
        kinematics.update(joints)
        solution = ik.solve(random.normal(size=6) * 0.2)
        try:
            expected = mink.solve_ik(
                kinematics.configuration,
                [ik.task],
                0.1,
                "daqp",
                damping=1e-4,
                limits=ik.limits,
                primal_tol=1e-8,
            )
        except mink.NoSolutionFound:
            expected = np.zeros(6)
        assert (solution.joint_velocities == expected).all()
        constrained += solution.missing_m_s > 0.01
    assert 5 < constrained < 60


@pytest.mark.parametrize("seed", range(5))
def test_a_slow_twist_is_achieved(kinematics: Kinematics, seed: int):
    twist = np.random.default_rng(seed).uniform(-0.04, 0.04, 6)
    solution = VelocityIk(kinematics).solve(twist)
    achieved = kinematics.jacobian() @ solution.joint_velocities
    assert np.linalg.norm(achieved - twist) < 0.05 * np.linalg.norm(twist)
    assert solution.missing_m_s == pytest.approx(np.linalg.norm((achieved - twist)[:3]))


def test_a_fast_twist_is_cut_at_the_joint_speeds_and_the_loss_is_told(kinematics: Kinematics):
    solution = VelocityIk(kinematics).solve(np.array([0.0, 2.0, 0.0, 0.0, 0.0, 0.0]))
    assert (np.abs(solution.joint_velocities) <= np.array(JACO.robot.limits.velocity_rad_s) + 1e-6).all()
    assert solution.missing_m_s > 0.5


@pytest.mark.parametrize(("joint", "limit"), [(1, 5.462881), (2, 5.951573)])
def test_a_joint_comes_to_rest_before_its_end(kinematics: Kinematics, joint: int, limit: float):
    ik, joints = VelocityIk(kinematics), HOME.copy()
    joints[joint] = limit - 0.05
    for _ in range(100):
        kinematics.update(joints)
        outwards = kinematics.jacobian()[:, joint]  # the twist of this joint alone
        joints = joints + 0.01 * ik.solve(outwards).joint_velocities
    assert limit - 0.05 < joints[joint] <= limit


def test_the_hand_does_not_enter_the_panel(kinematics: Kinematics):
    """The panel is put where the tip is, so that hand and plug would have to pass through it."""
    ik, tip = VelocityIk(kinematics), kinematics.tip
    into = np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert ik.solve(into).missing_m_s < 0.01
    receptacle = tip.copy()
    receptacle[0] -= 0.145  # 5 cm between palm and panel
    kinematics.place_panel(receptacle)
    joints = HOME.copy()
    for _ in range(300):
        joints = joints + 0.01 * ik.solve(into).joint_velocities
        kinematics.update(joints)
    assert kinematics.tip[0] - tip[0] < 0.06
    assert ik.solve(into).missing_m_s > 0.05


def test_no_joint_is_told_to_accelerate_more_than_its_drive_can():
    before, wanted = np.zeros(6), np.array([0.1, 0.0, 0.0, 0.0, -0.4, 0.2])
    most = np.array(JACO.robot.limits.acceleration_rad_s2)
    told = ramped(before, wanted, most, 0.01)
    assert told[4] == pytest.approx(-0.025)
    assert told == pytest.approx(wanted * told[4] / wanted[4])
    assert (np.abs(told) <= 0.01 * most).all()
    assert (ramped(before, 0.02 * wanted, most, 0.01) == 0.02 * wanted).all()


@pytest.mark.parametrize("name", ["panda", "baxter-left"])
def test_a_redundant_arm_returns_to_its_rest_posture_while_its_tip_stands_still(name: str):
    cell = Cell(robot=find_robot(name))
    kinematics, home = Kinematics(cell), np.array(cell.robot.home_rad)
    spare = np.linalg.svd(kinematics.jacobian())[2][-1]  # the joint motion that does not move the tip
    kinematics.update(home + 0.3 * spare)
    ik, tip, joints = VelocityIk(kinematics), kinematics.tip, kinematics.joints_rad
    away = np.abs(joints - home).max()
    for _ in range(500):
        joints = joints + 0.01 * ik.solve(10.0 * difference(kinematics.tip, tip)).joint_velocities
        kinematics.update(joints)
    assert np.linalg.norm(difference(kinematics.tip, tip)) < 1e-3
    assert np.abs(joints - home).max() < max(0.25 * away, 0.03)
