from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from farhand.common.errors import InvalidInput
from farhand.common.model.manifold import POSE, Manifold
from tests.strategies import random_points, seeds, spaces


@settings(deadline=None, derandomize=True, max_examples=60)
@given(seed=seeds, space=spaces)
def test_log_and_exp_undo_each_other(seed: int, space: Manifold):
    rng = np.random.default_rng(seed)
    x, y = random_points(rng, space, 2, 5)
    np.testing.assert_allclose(space.log(x, space.exp(x, space.log(x, y))), space.log(x, y), atol=1e-12)
    np.testing.assert_allclose(space.distance(space.exp(x, space.log(x, y)), y, 1.0), 0.0, atol=1e-7)
    t = rng.normal(size=space.n_tangent)
    np.testing.assert_allclose(space.log(x, space.exp(x, t)), np.broadcast_to(t, (5, t.size)), atol=1e-12)


@settings(deadline=None, derandomize=True, max_examples=60)
@given(seed=seeds)
def test_orientations_differ_by_the_rotation_vector_in_the_axes_of_the_body(seed: int):
    x, y = random_points(np.random.default_rng(seed), POSE, 2)
    a, b = (Rotation.from_quat(p[3:], scalar_first=True) for p in (x, y))
    np.testing.assert_allclose(POSE.log(x, y)[3:], (a.inv() * b).as_rotvec(), atol=1e-12)
    np.testing.assert_allclose(POSE.log(x, y)[:3], y[:3] - x[:3])


@settings(deadline=None, derandomize=True, max_examples=60)
@given(seed=seeds)
def test_a_quaternion_and_its_antipode_are_one_orientation(seed: int):
    x, y = random_points(np.random.default_rng(seed), POSE, 2)
    flip = np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0])
    for a, b in ((flip * x, y), (x, flip * y), (flip * x, flip * y)):
        np.testing.assert_array_equal(POSE.log(a, b), POSE.log(x, y))


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-7, 1e-4, 0.009, 0.011, 1.0, 3.1, np.pi - 1e-9, np.pi])
def test_small_rotations_and_half_turns_keep_their_digits(angle: float):
    x, axis = random_points(np.random.default_rng(0), POSE), np.array([0.6, 0.0, -0.8])
    tangent = np.concatenate([np.zeros(3), angle * axis])
    back = POSE.log(x, POSE.exp(x, tangent))[3:]
    if angle == np.pi:  # both ways round are right
        back = back * np.sign(back @ axis)
    np.testing.assert_allclose(back, angle * axis, rtol=1e-9, atol=1e-15)


@settings(deadline=None, derandomize=True, max_examples=60)
@given(seed=seeds, space=spaces, scale=st.sampled_from([1e-9, 1e-3, 0.3, 1.0, 3.0]))
def test_the_jacobian_is_that_of_finite_differences(seed: int, space: Manifold, scale: float):
    rng = np.random.default_rng(seed)
    x, t = random_points(rng, space), rng.normal(size=space.n_tangent)
    t *= scale / np.linalg.norm(t)
    moved, h = space.exp(x, t), 1e-6
    differences = [
        (space.log(moved, space.exp(x, t + h * e)) - space.log(moved, space.exp(x, t - h * e))) / (2 * h)
        for e in np.eye(space.n_tangent)
    ]
    np.testing.assert_allclose(space.jacobian(t), np.array(differences).T, atol=1e-8)


def test_a_radian_has_its_price():
    x = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    y = POSE.exp(x, np.array([0.3, 0.0, 0.0, 0.0, 2.0, 0.0]))
    assert POSE.distance(x, y, metres_per_radian=0.2) == pytest.approx(0.5)
    assert Manifold(2).distance(np.zeros(2), np.array([3.0, 4.0]), metres_per_radian=9.0) == 5.0


def test_points_are_checked_and_rounding_is_mended():
    good = np.array([1.0, 2.0, 3.0, 0.6, 0.8, 0.0, 0.0])
    mended = POSE.checked(good * [1, 1, 1, 1.0005, 1.0005, 1, 1], "test", "points")
    np.testing.assert_allclose(mended, good, atol=1e-12)
    for bad in (good[:6], good * 2.0, good * np.nan, np.zeros(7), np.float64(3.0)):
        with pytest.raises(InvalidInput, match="test: points"):
            POSE.checked(bad, "test", "points")
    with pytest.raises(InvalidInput, match="2 numbers"):
        Manifold(2).checked(np.zeros(3), "test", "points")


def test_only_space_has_orientations():
    with pytest.raises(InvalidInput, match="3 for poses"):
        Manifold(2, oriented=True)
    assert Manifold.of(7, 6) == POSE
    assert Manifold.of(3, 3) == Manifold(3)
    with pytest.raises(InvalidInput):
        Manifold.of(4, 3)
