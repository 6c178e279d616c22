from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.task_frame import FrameArrays, TaskFrame
from farhand.remote_site.reproduction.frame_motion import FrameMotion

DT = 0.02
ONE = np.eye(2)[None]


def arrays(*frames: TaskFrame) -> FrameArrays:
    return FrameArrays.of(frames, oriented=False)


def watched(origins: NDArray) -> FrameMotion:
    motion = FrameMotion.still(arrays(TaskFrame(np.eye(2), origins[0])))
    for b in origins[1:]:
        motion = motion.updated(arrays(TaskFrame(np.eye(2), b)), DT)
    return motion


def test_uniform_acceleration_is_estimated_exactly():
    t = DT * np.arange(200.0)[:, None]
    motion = watched(np.array([0.3, -0.1]) * t + 0.5 * np.array([0.02, 0.05]) * t**2)
    np.testing.assert_allclose(motion.acceleration[0], [0.02, 0.05], atol=1e-6)
    np.testing.assert_allclose(
        motion.velocity[0], np.array([0.3, -0.1]) + np.array([0.02, 0.05]) * t[-1], atol=1e-6
    )


def test_noise_is_filtered():
    noise = 0.003 * np.random.default_rng(0).normal(size=(500, 2))
    motion = watched(noise)
    assert np.linalg.norm(motion.velocity) < 0.05  # raw differences: 0.2 m/s
    assert np.linalg.norm(motion.acceleration) < 0.5  # raw differences: 18 m/s^2


def test_a_jump_is_no_velocity():
    t = DT * np.arange(100.0)[:, None]
    origins = np.array([0.1, 0.0]) * t
    origins[60:] += [0.5, 0.5]
    np.testing.assert_allclose(watched(origins).velocity[0], [0.1, 0.0], atol=0.002)
    assert watched(np.zeros((10, 2))).velocity.tolist() == [[0.0, 0.0]]


def test_a_turning_frame_carries_its_points_along():
    rate = np.array([0.0, 0.0, 0.2])
    frames = [TaskFrame(Rotation.from_rotvec(rate * DT * n).as_matrix(), np.zeros(3)) for n in range(200)]
    motion = FrameMotion.still(arrays(frames[0]))
    for frame in frames[1:]:
        motion = motion.updated(arrays(frame), DT)
    arm, weights = np.array([1.0, 0.0, 0.0]), np.eye(3)[None]
    np.testing.assert_allclose(motion.velocity_at(arm, weights), np.cross(rate, arm), atol=1e-5)
    centripetal = np.cross(rate, np.cross(rate, arm))
    np.testing.assert_allclose(motion.acceleration_at(arm, np.zeros(3), weights), centripetal, atol=1e-5)
    coriolis = 2.0 * np.cross(rate, [0.0, 1.0, 0.0])
    moving = motion.acceleration_at(arm, np.array([0.0, 1.0, 0.0]), weights)
    np.testing.assert_allclose(moving, centripetal + coriolis, atol=1e-4)
