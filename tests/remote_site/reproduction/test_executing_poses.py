from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.errors import InvalidInput
from farhand.common.model.manifold import POSE
from farhand.common.model.task_frame import FrameArrays, TaskFrame
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings
from farhand.remote_site.reproduction.frame_motion import FrameMotion
from farhand.remote_site.reproduction.point_rollout import roll_out
from farhand.remote_site.reproduction.reference import seen_from
from tests.strategies import learned, pose_stroke, random_covariances, random_frame, random_points, seeds

DT = 0.02
MODEL = learned(POSE, n_demonstrations=4)
END = np.array([0.0, 0.0, 0.0, 0.6, 0.8, 0.0, 0.0])


@settings(deadline=None, derandomize=True, max_examples=30)
@given(seed=seeds)
def test_the_cost_seen_from_the_robot_is_that_of_the_distance_to_the_target(seed: int):
    """Against finite differences, with an anisotropic covariance and a target far round."""
    rng = np.random.default_rng(seed)
    here, target, Q = random_points(rng, POSE), random_points(rng, POSE), random_covariances(rng, 6)
    tangents, costs = seen_from(here, target[None], Q[None])

    def missed(t: NDArray) -> NDArray:
        return POSE.log(target, POSE.exp(here, t))

    h = 1e-6
    J = np.array([(missed(tangents[0] + h * e) - missed(tangents[0] - h * e)) / (2 * h) for e in np.eye(6)]).T
    np.testing.assert_allclose(missed(tangents[0]), 0.0, atol=1e-12)
    np.testing.assert_allclose(costs[0], J.T @ Q @ J, atol=1e-7 * np.abs(Q).max())


def test_a_reference_that_passes_half_a_turn_has_no_jump():
    angles = np.linspace(0.8 * np.pi, 1.3 * np.pi, 40)
    here, axis = random_points(np.random.default_rng(0), POSE), np.array([0.0, 0.0, 0.0, 0.0, 0.6, 0.8])
    targets = POSE.exp(here, angles[:, None] * axis)
    tangents, _ = seen_from(here, targets, np.broadcast_to(np.eye(6), (40, 6, 6)).copy())
    np.testing.assert_allclose(tangents, angles[:, None] * axis, atol=1e-9)


@settings(deadline=None, derandomize=True, max_examples=6)
@given(seed=seeds)
def test_a_pose_is_reached_wherever_the_frame_is(seed: int):
    rng = np.random.default_rng(seed)
    frame = random_frame(rng, 3)
    start = frame.to_world(pose_stroke(rng, 10)[0])
    result = roll_out(MODEL, start, lambda t: [frame])
    assert result.arrived
    end = POSE.log(END, frame.to_local(result.points[-1]))
    assert np.linalg.norm(end[:3]) < 0.02
    assert np.linalg.norm(end[3:]) < 0.06
    assert result.quat_wxyz is not None
    np.testing.assert_allclose(np.linalg.norm(result.quat_wxyz, axis=1), 1.0, atol=1e-12)


@settings(deadline=None, derandomize=True, max_examples=4)
@given(seed=seeds)
def test_moving_the_whole_scene_moves_the_motion(seed: int):
    rng = np.random.default_rng(seed)
    world, start = random_frame(rng, 3), pose_stroke(rng, 10)[0]
    here = roll_out(MODEL, start, lambda t: [TaskFrame.identity(3)])
    there = roll_out(MODEL, world.to_world(start), lambda t: [world])
    assert len(here.points) == len(there.points)
    np.testing.assert_allclose(POSE.log(world.to_world(here.points), there.points), 0.0, atol=1e-9)


@pytest.mark.parametrize("angle", [1.0, 2.8, np.pi - 1e-6, np.pi])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_tool_that_was_turned_by_up_to_half_a_turn_is_turned_back(angle: float, sign: float):
    executor, frames = Executor(MODEL, ExecutorSettings()), [TaskFrame.identity(3)]
    rng = np.random.default_rng(0)
    x = POSE.exp(END, np.array([0.0, 0.0, 0.0, 0.0, 0.8 * angle, 0.6 * angle]))
    x[3:] *= sign
    v = np.zeros(6)
    executor.begin(x, v, frames)
    for _ in range(1000):
        seen = POSE.exp(x, 1e-3 * rng.normal(size=6))  # a measurement that could choose either way round
        u = executor.step(seen, v, frames).acceleration
        x, v = POSE.exp(x, DT * v + 0.5 * DT**2 * u), v + DT * u
    assert POSE.distance(x, END, metres_per_radian=1.0) < 0.05


@settings(deadline=None, derandomize=True, max_examples=20)
@given(seed=seeds)
def test_a_quaternion_and_its_antipode_are_commanded_alike(seed: int):
    x, v = random_points(np.random.default_rng(seed), POSE), np.zeros(6)
    flipped = x * [1, 1, 1, -1, -1, -1, -1]
    commands = []
    for point in (x, flipped):
        executor, frames = Executor(MODEL, ExecutorSettings()), [TaskFrame.identity(3)]
        executor.begin(point, v, frames)
        commands.append(executor.step(point, v, frames).acceleration)
    np.testing.assert_allclose(commands[0], commands[1], rtol=1e-9, atol=1e-9)


def test_a_tool_follows_a_frame_that_turns():
    """Sway of 0.1 rad in 6 s: without the frame's own rotation the tool would lag by 0.02 rad and more."""
    executor = Executor(MODEL, ExecutorSettings())

    def frame_at(t: float) -> list[TaskFrame]:
        turn = Rotation.from_rotvec([0.0, 0.1 * np.sin(2 * np.pi * t / 6.0), 0.0])
        return [TaskFrame(turn.as_matrix(), np.array([0.05 * np.sin(2 * np.pi * t / 6.0), 0.0, 0.0]))]

    x, v = pose_stroke(np.random.default_rng(3), 10)[0], np.zeros(6)
    executor.begin(x, v, frame_at(0.0))
    errors = []
    for n in range(900):
        u = executor.step(x, v, frame_at(n * DT)).acceleration
        x, v = POSE.exp(x, DT * v + 0.5 * DT**2 * u), v + DT * u
        errors.append(POSE.log(END, frame_at((n + 1) * DT)[0].to_local(x)))
    last = np.array(errors[-300:])
    assert np.linalg.norm(last[:, 3:] - last[:, 3:].mean(axis=0), axis=1).max() < 0.01
    assert np.linalg.norm(last[:, :3] - last[:, :3].mean(axis=0), axis=1).max() < 0.005


@settings(deadline=None, derandomize=True, max_examples=20)
@given(seed=seeds, spin=st.sampled_from([0.05, 0.3]))
def test_the_frame_carries_a_pose_along(seed: int, spin: float):
    """Velocity and acceleration of a pose that moves steadily in a turning frame, by finite differences."""
    rng = np.random.default_rng(seed)
    axis, h = rng.normal(size=3), 1e-4
    axis *= spin / np.linalg.norm(axis)
    relative = rng.normal(size=3)  # body rates in the frame [rad/s]

    def frame_at(t: float) -> TaskFrame:
        return TaskFrame(Rotation.from_rotvec(axis * t).as_matrix(), np.zeros(3))

    begin = random_points(rng, POSE)

    def pose_at(t: float) -> NDArray:
        return frame_at(t).to_world(POSE.exp(begin, np.concatenate([np.zeros(3), relative * t])))

    def rate(t: float) -> NDArray:
        return POSE.log(pose_at(t), pose_at(t + h))[3:] / h

    motion = FrameMotion.still(FrameArrays.of([frame_at(-2.0)], oriented=True))
    for n in range(1, 201):
        motion = motion.updated(FrameArrays.of([frame_at(0.01 * (n - 200))], oriented=True), 0.01)
    weights, velocity = np.eye(6)[None], np.concatenate([np.zeros(3), relative])
    along = motion.velocity_at(pose_at(0.0), weights)[3:]
    np.testing.assert_allclose(along + relative, rate(0.0), atol=1e-3 * spin)
    acceleration = motion.acceleration_at(pose_at(0.0), velocity, weights)[3:]
    difference = (rate(0.0) - rate(-h)) / h
    np.testing.assert_allclose(acceleration, difference, atol=1e-3 * spin)


def test_two_frames_share_the_pose():
    model = learned(POSE, n_frames=2)
    frames = [TaskFrame.identity(3)] * 2
    result = roll_out(model, pose_stroke(np.random.default_rng(1), 10)[0], lambda t: frames)
    assert result.arrived
    assert POSE.distance(result.points[-1], END, metres_per_radian=0.2) < 0.03


def test_limits_hold_for_both_parts():
    limits = ExecutorSettings(
        max_acceleration_m_s2=1.0, max_angular_acceleration_rad_s2=2.0, max_angular_speed_rad_s=0.4
    )
    executor, frames = Executor(MODEL, limits), [TaskFrame.identity(3)]
    x, v = POSE.exp(END, np.array([0.3, 0.2, 0.0, 1.0, 0.5, 0.0])), np.zeros(6)
    executor.begin(x, v, frames)
    for _ in range(300):
        u = executor.step(x, v, frames).acceleration
        assert np.linalg.norm(u[:3]) <= 1.0 + 1e-9
        assert np.linalg.norm(u[3:]) <= 2.0 + 1e-9
        x, v = POSE.exp(x, DT * v + 0.5 * DT**2 * u), v + DT * u
        assert np.linalg.norm(v[3:]) <= 0.4 + 2.0 * DT


def test_a_pose_that_is_none_is_refused():
    executor, frames = Executor(MODEL, ExecutorSettings()), [TaskFrame.identity(3)]
    executor.begin(END, np.zeros(6), frames)
    for point, velocity in (
        (END[:6], np.zeros(6)),
        (2 * END, np.zeros(6)),
        (END, np.zeros(3)),
        (END * np.nan, np.zeros(6)),
    ):
        with pytest.raises(InvalidInput, match=r"executor: (point|velocity)"):
            executor.step(point, velocity, frames)
