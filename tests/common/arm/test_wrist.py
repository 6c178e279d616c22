"""The wrist's sensor: no weight, no bias, torques about the tip."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from farhand.common.arm.compliance import Wrist
from farhand.common.arm.kinematics import Kinematics
from tests.cells import JACO

KINEMATICS = Kinematics(JACO)
MASS_KG, CENTRE_M = KINEMATICS.tool_weight()
REACH_M = np.array([0.0, 0.0, KINEMATICS.cell.plug.reach_m])


def turned(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rotation = Rotation.random(rng=np.random.default_rng(seed))
    return np.concatenate([[0.6, 0.1, 0.4], rotation.as_quat(scalar_first=True)]), rotation.as_matrix()


def measured(R: np.ndarray, force: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """What a sensor has for a load at the tip, in its own axes."""
    weight = R.T @ np.array([0.0, 0.0, -9.81 * MASS_KG])
    moment = np.cross(CENTRE_M, weight) + np.cross(REACH_M, force) + torque
    return np.concatenate([weight + force, moment])


@pytest.mark.parametrize("seed", range(4))
def test_the_load_at_the_tip_is_found_in_any_orientation(seed: int):
    wrist = Wrist(KINEMATICS)
    pose, R = turned(seed)
    force, torque = np.random.default_rng(seed).normal(size=(2, 3)) * [[20.0], [2.0]]
    wrist.update(measured(R, force, torque), pose)
    assert wrist.force == pytest.approx(R @ force)
    assert wrist.torque == pytest.approx(torque)
    for _ in range(60):
        wrist.update(measured(R, force, torque), pose)
    assert wrist.smooth == pytest.approx(np.concatenate([force, torque]), rel=1e-4, abs=1e-4)


def test_a_tare_takes_away_what_is_measured_in_the_next_moments():
    wrist = Wrist(KINEMATICS)
    pose, R = turned(1)
    bias = np.array([1.0, -2.0, 3.0])
    wrist.tare()
    for _ in range(41):
        wrist.update(measured(R, bias, np.zeros(3)), pose)
    assert np.abs(wrist.force).max() < 1e-9
    wrist.update(measured(R, bias + np.array([0.0, 0.0, 5.0]), np.zeros(3)), pose)
    assert wrist.force == pytest.approx(R @ [0.0, 0.0, 5.0])
