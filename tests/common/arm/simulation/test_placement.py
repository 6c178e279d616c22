from __future__ import annotations

import numpy as np
import pytest

from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.simulation import Simulation
from farhand.common.arm.simulation.starts_and_goals import Box, Placement
from farhand.common.model.task_frame import TaskFrame
from tests.cells import JACO


@pytest.mark.parametrize("box", [Box.of(JACO.robot), Box.of(JACO.robot).widened()])
def test_receptacles_fill_their_box_and_face_the_arm(box: Box):
    random = np.random.default_rng(0)
    poses = np.array([box.sample(random) for _ in range(2000)])
    np.testing.assert_allclose(poses[:, :3].min(axis=0), box.low_m, atol=0.002)
    np.testing.assert_allclose(poses[:, :3].max(axis=0), box.high_m, atol=0.002)
    inwards = np.array(
        [TaskFrame.at(pose).A[0, 2] for pose in poses]
    )  # of the bore's axis, along the base's x
    tilts = np.degrees(np.arccos(inwards))
    assert 14.5 < tilts.max() <= 15.0 and tilts.min() < 1.0


def test_one_seed_is_one_placement():
    one, same = (Placement.sample(np.random.default_rng(4), Box.of(JACO.robot), JACO) for _ in range(2))
    np.testing.assert_array_equal(one.receptacle, same.receptacle)
    np.testing.assert_array_equal(one.joints_rad, same.joints_rad)
    assert np.abs(one.joints_rad - JACO.robot.home_rad).max() < 0.6


def test_a_seated_plug_is_in_its_bore_and_touches_nothing():
    simulation = Simulation(JACO)
    for seed in range(3):
        receptacle, joints_rad = Placement.seated(np.random.default_rng(seed), Box.of(JACO.robot), JACO)
        around = Surroundings.still(JACO).with_receptacle(receptacle)
        simulation.reset(joints_rad, around)
        at_first = simulation.insertion
        assert 0.0825 <= at_first.depth_m <= 0.085 and at_first.lateral_m < 0.0005
        weight = simulation.wrench
        for _ in range(40):
            simulation.step(np.zeros(6), around)
        np.testing.assert_allclose(simulation.wrench, weight, atol=0.1)
        assert simulation.deflection_m < 1e-5
