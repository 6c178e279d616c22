from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.spatial.transform import Rotation

from farhand.common.model.task_frame import TaskFrame
from farhand.remote_site.insertion.contact_estimate import ContactCorrection
from tests.strategies import random_frame, seeds

NOTHING = np.zeros(3)


def felt(
    force: tuple, torque: tuple = (0, 0, 0), quiet: bool = True, for_s: float = 1.0
) -> ContactCorrection:
    correction = ContactCorrection()
    for _ in range(round(for_s * 100)):
        correction.update(np.array(force, dtype=float), np.array(torque, dtype=float), quiet, 0.01)
    return correction


def test_a_force_from_the_side_moves_the_frame_to_where_it_pushes():
    np.testing.assert_allclose(felt((4.0, 0.0, 50.0)).shift_m, [0.005, 0.0, 0.0])


def test_a_tilting_torque_turns_the_frame():
    np.testing.assert_allclose(felt((0, 0, 0), (0.0, 0.4, 9.0)).turn_rad, [0.0, 0.05, 0.0])


def test_small_forces_and_the_axial_ones_say_nothing():
    correction = felt((2.0, -2.0, 200.0), (0.2, 0.2, 5.0))
    assert not correction.shift_m.any() and not correction.turn_rad.any()


def test_nothing_is_learned_from_a_receptacle_that_moves():
    assert not felt((30.0, 0.0, 0.0), quiet=False).shift_m.any()


def test_however_hard_the_contact_the_frame_moves_no_faster_than_the_arm_follows():
    correction = felt((0.0, 300.0, 0.0), (5.0, 0.0, 0.0), for_s=0.5)
    np.testing.assert_allclose(np.linalg.norm(correction.shift_m), 0.010, rtol=1e-3)
    np.testing.assert_allclose(correction.turn_rad, [0.05, 0.0, 0.0])


def test_it_is_bounded_and_can_be_cleared():
    correction = felt((0.0, 300.0, 0.0), (5.0, 0.0, 0.0), for_s=20.0)
    np.testing.assert_allclose(np.linalg.norm(correction.shift_m), 0.030)
    np.testing.assert_allclose(correction.turn_rad, [0.12, 0.0, 0.0])
    correction.clear()
    assert not correction.shift_m.any() and not correction.turn_rad.any()


@settings(deadline=None, derandomize=True, max_examples=40)
@given(seed=seeds)
def test_a_plug_that_is_anchored_often_defines_the_frame(seed: int):
    """The axis of the plug becomes that of the frame, wherever the frame is and how deep the plug."""
    rng = np.random.default_rng(seed)
    seen = random_frame(rng, 3)
    tilt = Rotation.from_rotvec([*rng.uniform(-0.06, 0.06, 2), 0.0])
    depth_m = rng.uniform(-0.02, 0.07)
    through = np.array([*rng.uniform(-0.01, 0.01, 2), 0.0])
    tip = through + depth_m * tilt.as_matrix()[:, 2]
    plug = seen.to_world(np.concatenate([tip, tilt.as_quat(scalar_first=True)]))
    correction = ContactCorrection()
    for _ in range(30):
        correction.anchor(correction.corrected(seen).to_local(plug))
    local = correction.corrected(seen).to_local(plug)
    np.testing.assert_allclose(local[:3], [0.0, 0.0, depth_m], atol=5e-4)
    np.testing.assert_allclose(local[4:6], 0.0, atol=1e-4)


def test_one_anchoring_goes_seven_tenths_of_the_way():
    correction = ContactCorrection()
    correction.anchor(np.array([0.01, 0.0, 0.03, 1.0, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(correction.shift_m, [0.007, 0.0, 0.0])


def test_a_bottom_that_is_felt_moves_the_frame_along_its_axis():
    correction = ContactCorrection()
    correction.push(-0.02)
    frame = TaskFrame.at(np.array([0.8, 0.0, 0.4, 0.5, -0.5, 0.5, -0.5]))
    np.testing.assert_allclose(correction.corrected(frame).b, [0.78, 0.0, 0.4], atol=1e-12)


def test_without_contact_the_frame_is_as_seen():
    frame = TaskFrame.at(np.array([0.8, 0.0, 0.4, 0.5, -0.5, 0.5, -0.5]))
    np.testing.assert_allclose(ContactCorrection().corrected(frame).A, frame.A)
    np.testing.assert_array_equal(ContactCorrection().corrected(frame).b, frame.b)


@pytest.mark.parametrize("dt_s", [0.002, 0.05])
def test_the_period_does_not_matter(dt_s: float):
    correction = ContactCorrection()
    for _ in range(round(1.0 / dt_s)):
        correction.update(np.array([0.0, 5.0, 0.0]), NOTHING, True, dt_s)
    np.testing.assert_allclose(correction.shift_m, [0.0, 0.010, 0.0])
