"""How the arm gives way: beside the bore, in tilt, and along it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from farhand.common.arm.compliance import ComplianceSettings, Governor, SeenReceptacle, admittance
from farhand.common.arm.kinematics import AT_ORIGIN, difference, moved

SETTINGS = ComplianceSettings()
MOUTH = SeenReceptacle(AT_ORIGIN, np.zeros(6))


def at(depth_m: float) -> np.ndarray:
    return np.array([0.0, 0.0, depth_m, 1.0, 0.0, 0.0, 0.0])


def governor(depth_m: float, force_n: float) -> Governor:
    governor = Governor(SETTINGS)
    governor.look(MOUTH, at(depth_m), np.array([0.0, 0.0, -force_n]))
    return governor


def test_small_loads_move_nothing_and_loads_along_the_axis_neither():
    still = admittance(SETTINGS, np.array([2.0, 2.0, 500.0, 0.2, 0.2, 50.0]), AT_ORIGIN)
    assert (still == 0.0).all()


def test_it_gives_way_in_the_direction_of_the_load_up_to_a_limit():
    quarter = Rotation.from_rotvec([0.0, 0.5 * np.pi, 0.0]).as_quat(scalar_first=True)
    tip = np.concatenate([np.zeros(3), quarter])
    twist = admittance(SETTINGS, np.array([13.0, 0.0, 0.0, 0.0, -1.3, 0.0]), tip)
    assert twist == pytest.approx([0.0, 0.0, -0.01, 0.0, -0.1, 0.0])  # the tool's x points down now
    most = admittance(SETTINGS, np.array([0.0, 900.0, 0.0, 900.0, 0.0, 0.0]), AT_ORIGIN)
    assert most == pytest.approx([0.0, SETTINGS.lateral_most_m_s, 0.0, SETTINGS.tilt_most_rad_s, 0.0, 0.0])


def test_the_speed_along_the_bore_falls_with_the_force_and_turns_back():
    assert governor(0.03, 0.0).speed(0.05, 0.0, 0.0, holds=False) == pytest.approx(0.05)
    assert governor(0.03, 40.0).speed(0.05, 0.0, 0.0, holds=False) == pytest.approx(0.03)
    assert governor(0.03, 90.0).speed(0.05, 0.0, 0.0, holds=False) == pytest.approx(-0.045)
    assert governor(0.03, 900.0).speed(0.05, 0.0, 0.0, holds=False) == pytest.approx(-0.10)
    assert governor(0.03, 30.0).speed(0.05, 0.0, 0.0, holds=True) < 0.0


def test_it_is_seated_deep_in_with_force_and_leaves_when_the_setpoint_does():
    deep = governor(0.083, 30.0)
    deep.speed(0.05, 0.0, 0.0, holds=False)
    assert deep.seated
    deep.look(MOUTH, at(0.083), np.zeros(3))  # what it presses against went away
    assert deep.speed(0.0, 0.0, 0.0, holds=False) > 0.01
    assert deep.seated
    deep.speed(-0.05, -0.0095, -0.05, holds=False)
    assert not deep.seated


@pytest.mark.parametrize(("depth_m", "force_n"), [(0.05, 50.0), (0.083, 5.0), (-0.2, 50.0)])
def test_neither_force_nor_depth_alone_is_a_seat(depth_m: float, force_n: float):
    one = governor(depth_m, force_n)
    one.speed(0.05, 0.0, 0.0, holds=False)
    assert not one.seated


def test_a_receptacle_that_is_not_known_or_far_beside_is_none_to_care_for():
    aside = governor(0.05, 0.0)
    aside.look(MOUTH, np.array([0.1, 0.0, 0.05, 1.0, 0.0, 0.0, 0.0]), np.zeros(3))
    assert not aside.active
    aside.look(None, AT_ORIGIN, np.zeros(3))
    assert not aside.active


@pytest.mark.parametrize("seed", range(4))
def test_what_moves_with_the_receptacle_has_the_velocity_of_a_rigid_body(seed: int):
    random, h = np.random.default_rng(seed), 1e-6
    turn = Rotation.random(2, rng=random).as_quat(scalar_first=True)
    mouth, tool = (np.concatenate([random.normal(size=3), quat]) for quat in turn)
    twist = random.normal(size=6)
    before, after = moved(mouth, -h * twist), moved(mouth, h * twist)

    def carried(by: np.ndarray) -> np.ndarray:
        R = Rotation.from_quat([by[3:], mouth[3:], tool[3:]], scalar_first=True)
        position = by[:3] + (R[0] * R[1].inv()).apply(tool[:3] - mouth[:3])
        return np.concatenate([position, (R[0] * R[1].inv() * R[2]).as_quat(scalar_first=True)])

    expected = difference(carried(before), carried(after)) / (2 * h)
    assert SeenReceptacle(mouth, twist).velocity_at(tool) == pytest.approx(expected, abs=1e-5)
