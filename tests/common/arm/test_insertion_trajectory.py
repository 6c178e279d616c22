from __future__ import annotations

import numpy as np

from farhand.common.arm.kinematics import Kinematics, difference
from farhand.common.arm.preflight import WAY_M, InsertionTrajectory, in_bore
from farhand.common.arm.simulation.disturbances import Surroundings
from tests.cells import JACO

RECEPTACLE = Surroundings.still(JACO).receptacle


def test_the_way_leads_along_the_axis_to_the_bottom_and_the_arm_goes_along():
    way_in = InsertionTrajectory(Kinematics(JACO))
    depth_m = JACO.receptacle.depth_m
    went = []
    for pose in way_in.go(np.array(JACO.robot.home_rad), RECEPTACLE):
        np.testing.assert_allclose(difference(way_in.kinematics.tip, pose), 0.0, atol=1e-5)
        went.append(pose)
    np.testing.assert_allclose(went[0], in_bore(RECEPTACLE, depth_m - WAY_M), atol=1e-12)
    np.testing.assert_allclose(went[-1], in_bore(RECEPTACLE, depth_m), atol=1e-12)
    along = np.diff([pose[:3] for pose in went], axis=0)
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 0.005, atol=1e-9)
