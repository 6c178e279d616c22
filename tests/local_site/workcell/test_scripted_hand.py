from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from farhand.local_site.workcell.scripted_hand import ScriptedExtraction, ScriptedHand, ScriptedInsertion

DEPTH_M = 0.085
START = np.array([0.05, -0.1, -0.25, *Rotation.from_rotvec([0.2, -0.3, 0.1]).as_quat(scalar_first=True)])


def motion(seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    hand = ScriptedHand(ScriptedInsertion(START, DEPTH_M, random), random)
    time_s = np.arange(0.0, hand.duration_s, 0.01)
    return time_s, np.array([hand.target(t) for t in time_s])


@pytest.mark.parametrize("seed", range(5))
def test_the_hand_goes_from_where_the_plug_is_to_the_end_of_the_bore(seed: int):
    _, target = motion(seed)
    np.testing.assert_allclose(target[0], START, atol=1e-12)
    np.testing.assert_allclose(target[-1, :3], [0.0, 0.0, DEPTH_M], atol=0.004)
    assert 2.0 * np.abs(target[-1, 4:]).max() < np.radians(1.0)


@pytest.mark.parametrize("seed", range(5))
def test_it_comes_into_the_mouth_along_the_axis_and_aligned(seed: int):
    _, target = motion(seed)
    at_mouth = np.abs(target[:, 2]) < 0.01
    assert at_mouth.any()
    assert np.hypot(*target[at_mouth, :2].T).max() < 0.005
    assert 2.0 * np.linalg.norm(target[at_mouth, 4:6], axis=1).max() < np.radians(2.0)


def test_it_waits_before_the_mouth():
    _, target = motion(1)
    near = target[(target[:, 2] < -0.08) & (target[:, 2] > -0.16)]
    assert len(near) > 30


def test_its_target_steps_twenty_times_a_second_and_never_far():
    _, target = motion(2)
    steps = np.linalg.norm(np.diff(target[:, :3], axis=0), axis=1)
    assert np.count_nonzero(steps) <= len(target) / 5 + 1
    assert steps.max() < 0.02


def test_hands_differ_and_one_seed_is_one_hand():
    np.testing.assert_array_equal(motion(3)[1], motion(3)[1])
    a, b = motion(3)[1], motion(4)[1]
    n = min(len(a), len(b))
    assert np.linalg.norm(a[:n, :3] - b[:n, :3], axis=1).max() > 0.01


def test_a_hand_that_takes_the_plug_out_drifts_little_in_the_bore_and_comes_to_rest():
    random = np.random.default_rng(6)
    seated = np.array([0.0, 0.0, 0.084, 1.0, 0.0, 0.0, 0.0])
    hand = ScriptedHand(ScriptedExtraction(seated, random), random)
    target = np.array([hand.target(t) for t in np.arange(0.0, hand.duration_s, 0.01)])
    np.testing.assert_allclose(target[0], seated, atol=1e-12)
    assert np.hypot(*target[target[:, 2] > 0.0, :2].T).max() < 0.004
    assert np.linalg.norm(target[-1, :3] - target[-50, :3]) < 1e-6
