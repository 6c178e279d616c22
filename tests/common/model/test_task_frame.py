from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.spatial.transform import Rotation
from scipy.stats import special_ortho_group

from farhand.common.errors import InvalidInput
from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame, _rows_to_local, _rows_to_world
from tests.strategies import random_covariances, random_frame, random_points, seeds, spaces


@settings(deadline=None, derandomize=True, max_examples=40)
@given(seed=seeds, space=spaces)
def test_there_and_back_is_the_same_point(seed: int, space: Manifold):
    rng = np.random.default_rng(seed)
    frame, x = random_frame(rng, space.n_dims), random_points(rng, space, 4)
    np.testing.assert_allclose(frame.to_local(frame.to_world(x)), x, atol=1e-12)


@settings(deadline=None, derandomize=True, max_examples=40)
@given(seed=seeds)
def test_the_orientation_of_a_pose_is_turned_with_the_frame(seed: int):
    rng = np.random.default_rng(seed)
    frame, x = random_frame(rng, 3), random_points(rng, POSE)
    turned = Rotation.from_quat(frame.to_world(x)[3:], scalar_first=True).as_matrix()
    np.testing.assert_allclose(
        turned, frame.A @ Rotation.from_quat(x[3:], scalar_first=True).as_matrix(), atol=1e-12
    )


@settings(deadline=None, derandomize=True, max_examples=40)
@given(seed=seeds, space=spaces)
def test_covariances_are_those_of_the_points_that_moved(seed: int, space: Manifold):
    rng = np.random.default_rng(seed)
    frame, mean = random_frame(rng, space.n_dims), random_points(rng, space)
    tangents = rng.normal(size=(50, space.n_tangent)) @ random_covariances(rng, space.n_tangent) * 0.05
    tangents *= 2.0 / np.linalg.norm(tangents, axis=1).max()  # within half a turn
    seen = space.log(frame.to_world(mean), frame.to_world(space.exp(mean, tangents)))
    np.testing.assert_allclose(
        seen.T @ seen, frame.covariance_to_world(tangents.T @ tangents), rtol=1e-9, atol=1e-9
    )


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, 3.0, np.pi - 1e-9, np.pi])
def test_the_quaternion_of_a_frame_is_that_of_its_rotation(angle: float):
    for axis in np.random.default_rng(0).normal(size=(20, 3)):
        rotation = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
        quat = TaskFrame(rotation.as_matrix(), np.zeros(3)).quat_wxyz
        assert abs(quat @ rotation.as_quat(scalar_first=True)) == pytest.approx(1.0, abs=1e-12)


def test_orientations_need_a_rotation_of_space():
    with pytest.raises(InvalidInput, match="rotation of space"):
        _ = TaskFrame.identity(2).quat_wxyz


@pytest.mark.parametrize("n_dims", [2, 3])
@pytest.mark.parametrize("axis", [0, 1, -1])
def test_a_mirror_image_is_no_frame(n_dims: int, axis: int):
    turned = special_ortho_group.rvs(n_dims, random_state=3)
    TaskFrame(turned, np.zeros(n_dims))
    turned[axis] *= -1.0
    with pytest.raises(InvalidInput, match="mirror"):
        TaskFrame(turned, np.zeros(n_dims))


def test_malformed_frames_are_refused():
    for A, b in ((np.eye(2), np.zeros(3)), (2 * np.eye(2), np.zeros(2)), (np.eye(2), np.array([0, np.nan]))):
        with pytest.raises(InvalidInput, match="task frame"):
            TaskFrame(A, b)


@settings(deadline=None, derandomize=True, max_examples=40)
@given(seed=seeds)
def test_the_frame_of_a_body_has_its_pose_as_origin(seed: int):
    pose = random_points(np.random.default_rng(seed), POSE)
    frame = TaskFrame.at(pose)
    np.testing.assert_allclose(frame.to_world(np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))[:3], pose[:3])
    np.testing.assert_allclose(
        frame.A, Rotation.from_quat(pose[3:], scalar_first=True).as_matrix(), atol=1e-12
    )


def test_the_frame_of_a_body_without_orientation_has_the_axes_of_the_world():
    frame = TaskFrame.at(np.array([0.3, -0.2]))
    np.testing.assert_array_equal(frame.A, np.eye(2))
    np.testing.assert_array_equal(frame.b, [0.3, -0.2])


def test_whatever_array_comes_the_same_compiled_function_is_used():
    """Another kind of array would be compiled in the middle of an operator's work, which takes a second."""
    frame = TaskFrame.identity(3)
    points = np.ones((4, 3))
    frame.to_world(frame.to_local(points))
    compiled = [(kernel, len(kernel.signatures)) for kernel in (_rows_to_local, _rows_to_world)]
    frozen = points.copy()
    frozen.setflags(write=False)
    for other in (frozen, points[::2], points.T[:3, :3], points[0], np.asfortranarray(points)):
        frame.to_world(other)
        frame.to_local(other)
    assert [(kernel, len(kernel.signatures)) for kernel, _ in compiled] == compiled
