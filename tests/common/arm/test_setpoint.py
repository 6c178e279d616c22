"""The virtual body that the arm follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from farhand.common.arm.kinematics import difference, moved
from farhand.common.arm.setpoint import MotionLimits, Setpoint
from farhand.common.errors import InvalidConfiguration
from tests.cells import JACO

START = np.array([0.6, 0.0, 0.4, 0.5, -0.5, 0.5, -0.5])
STILL = np.zeros(6)


def test_it_integrates_what_is_asked_exactly():
    setpoint = Setpoint(MotionLimits.of(JACO.robot), START)
    for _ in range(50):
        setpoint.accelerate(np.array([0.1, 0.0, -0.2, 0.0, 0.4, 0.0]), STILL, 0.01)
    assert setpoint.velocity == pytest.approx([0.05, 0.0, -0.1, 0.0, 0.2, 0.0])
    assert difference(START, setpoint.pose) == pytest.approx([0.0125, 0.0, -0.025, 0.0, 0.05, 0.0])


@pytest.mark.parametrize("seed", range(4))
def test_speed_acceleration_and_box_hold_whatever_is_asked(seed: int):
    limits, random = MotionLimits.of(JACO.robot), np.random.default_rng(seed)
    setpoint = Setpoint(limits, START)
    for _ in range(600):
        before = setpoint.velocity.copy()
        setpoint.accelerate(
            random.normal(size=6) * 100.0 + 50.0 * np.sign(random.normal(size=6)), STILL, 0.01
        )
        after = setpoint.velocity
        assert np.linalg.norm(after[:3]) <= limits.speed_m_s + 1e-12
        assert np.linalg.norm(after[3:]) <= limits.angular_speed_rad_s + 1e-12
        assert np.linalg.norm((after - before)[3:]) <= 0.01 * limits.angular_acceleration_rad_s2 + 1e-12
        assert (setpoint.pose[:3] >= limits.low_m).all() and (setpoint.pose[:3] <= limits.high_m).all()


def test_the_speed_limit_is_relative_to_what_carries_it():
    setpoint, carried = Setpoint(MotionLimits.of(JACO.robot), START), np.array([0.0, 0.3, 0.0, 0.0, 0.0, 0.0])
    for _ in range(40):
        setpoint.accelerate(np.array([0.0, 9.0, 0.0, 0.0, 0.0, 0.0]), carried, 0.01)
    assert setpoint.velocity[1] == pytest.approx(0.45)


def test_at_the_edge_of_the_box_it_stops_and_may_turn_back():
    setpoint = Setpoint(replace(MotionLimits.of(JACO.robot), low_m=(0.25, -0.01, 0.05)), START)
    for _ in range(100):
        setpoint.accelerate(np.array([0.0, -1.0, 0.0, 0.0, 0.0, 0.0]), STILL, 0.01)
    assert setpoint.pose[1] == -0.01
    assert setpoint.velocity[1] == 0.0
    setpoint.accelerate(np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]), STILL, 0.01)
    assert setpoint.pose[1] > -0.01


def test_it_stays_near_an_arm_that_cannot_follow():
    setpoint = Setpoint(MotionLimits.of(JACO.robot), moved(START, np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.3])))
    setpoint.follow(START)
    assert difference(START, setpoint.pose) == pytest.approx([0.01, 0.0, 0.0, 0.0, 0.0, 0.1])


def test_pulled_back_it_is_neither_ahead_nor_fast():
    setpoint, axis = Setpoint(MotionLimits.of(JACO.robot), START), np.array([1.0, 0.0, 0.0])
    setpoint.velocity[:] = [0.1, 0.05, 0.0, 0.0, 0.0, 0.0]
    setpoint.pull_back(axis, 0.01, 0.02)
    assert setpoint.pose[0] == pytest.approx(0.59)
    assert setpoint.velocity == pytest.approx([0.02, 0.05, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    "wrong", [{"speed_m_s": 0.0}, {"low_m": (2.0, 0.0, 0.0)}, {"speed_m_s": float("nan")}]
)
def test_impossible_limits_are_refused(wrong: dict):
    with pytest.raises(InvalidConfiguration):
        replace(MotionLimits.of(JACO.robot), **wrong)
