"""Ways, by the batch statistics of whole motions as oracle."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray

from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.way import (
    N_COARSE,
    N_PHASES,
    OUTSIDE,
    between_coarse,
    distance_from_taught,
)
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.learning.way_regression import joined, model_of
from farhand.local_site.learning.way_statistics import COARSE, WayStatistics, WholeMotion
from tests.strategies import pose_stroke, seeds, stroke

SPACE, LAMBDA_M = Manifold(3), 0.1


def motions(random: np.random.Generator, n: int, n_frames: int = 1) -> list[WholeMotion]:
    """Ways from starts in a cube to the origin, through a common point and with a spread of their own."""
    found = []
    phase = np.linspace(0.0, 1.0, N_PHASES + 1)[:, None]
    for _ in range(n):
        start = np.array([0.5, 0.0, 0.4]) + random.uniform(-0.1, 0.1, 3)
        bend = np.array([0.0, 0.2, 0.1]) + 0.01 * random.normal(size=3)
        points = (1 - phase) ** 2 * start + phase * (1 - phase) * bend
        shares = np.sort(random.uniform(0.0, 1.0, N_PHASES - 1))
        found.append(
            WholeMotion(
                np.stack([points + p for p in range(n_frames)]),
                np.concatenate([[0.0], shares, [1.0]]),
                float(random.uniform(4.0, 8.0)),
                2,
            )
        )
    return found


def way_of(shown: list[WholeMotion], space: Manifold = SPACE) -> WayStatistics:
    way = WayStatistics.of(shown[0], space)
    for motion in shown[1:]:
        way = way.merged(WayStatistics.of(motion, space), space)
    return way


def cross(a: NDArray, b: NDArray) -> NDArray:
    """Batch scatter of two sets of rows. Shapes (n, T), (n, U)."""
    return (a - a.mean(axis=0)).T @ (b - b.mean(axis=0))


@settings(deadline=None, derandomize=True, max_examples=20)
@given(seed=seeds)
def test_the_statistics_of_a_way_are_the_batch_statistics_of_its_motions(seed: int):
    shown = motions(np.random.default_rng(seed), 6, n_frames=2)
    way = way_of(shown)
    points = np.stack([m.points for m in shown])  # (n, P, N + 1, D)
    shares, durations = np.stack([m.time_shares for m in shown]), np.log([m.duration_s for m in shown])
    np.testing.assert_allclose(way.points, points.mean(axis=0), atol=1e-14)
    np.testing.assert_allclose(way.time_shares, shares.mean(axis=0), atol=1e-14)
    for p in range(2):
        starts = points[:, p, 0]
        np.testing.assert_allclose(way.S[p], cross(starts, starts), atol=1e-14)
        for coarse, k in enumerate(COARSE):
            np.testing.assert_allclose(way.C[p, coarse], cross(points[:, p, k], starts), atol=1e-14)
            np.testing.assert_allclose(way.V[p, coarse], cross(points[:, p, k], points[:, p, k]), atol=1e-14)
    np.testing.assert_allclose(way.c, cross(shares[:, COARSE], points[:, -1, 0]), atol=1e-13)
    np.testing.assert_allclose(way.d, cross(durations[:, None], points[:, -1, 0])[0], atol=1e-13)
    assert way.ends.tolist() == [[2, 6]]


@settings(deadline=None, derandomize=True, max_examples=20)
@given(seed=seeds)
def test_merging_two_ways_is_learning_all_their_motions_in_one(seed: int):
    shown = motions(np.random.default_rng(seed), 7)
    apart, together = way_of(shown[:3]).merged(way_of(shown[3:]), SPACE), way_of(shown)
    for name, value in vars(together).items():
        np.testing.assert_allclose(getattr(apart, name), value, atol=1e-13, err_msg=name)


def test_the_statistics_of_poses_are_those_in_the_tangent_space_at_the_mean():
    """Motions whose rotations differ by up to a third of a radian: against the batch statistics at the mean."""
    random, phase = np.random.default_rng(3), np.linspace(0.0, 1.0, N_PHASES + 1)[:, None]
    base, shown = np.array([0.0, 0.0, 0.0, 0.6, 0.8, 0.0, 0.0]), []
    for _ in range(6):
        e = np.concatenate([0.2 * random.normal(size=3), 0.15 * random.normal(size=3)])
        points = POSE.exp(
            base, (1 - phase) * (np.array([0.4, 0, 0.3, 0.5, 0.2, 0.0]) + e) + phase * (1 - phase) * e[::-1]
        )
        shown.append(WholeMotion(points[None], phase[:, 0], 5.0, 0))
    way = way_of(shown, POSE)
    for coarse, k in enumerate(COARSE):
        x, s = (POSE.log(way.points[0, at], np.stack([m.points[0, at] for m in shown])) for at in (k, 0))
        assert np.abs(x.mean(axis=0)).max() < 2e-3  # the Karcher mean
        scale = np.abs(x.T @ x).max() + 1e-9
        assert np.abs(way.V[0, coarse] - x.T @ x).max() < 0.02 * scale
        assert np.abs(way.C[0, coarse] - x.T @ s).max() < 0.02 * np.sqrt(scale * np.abs(s.T @ s).max())


def test_the_order_of_demonstrations_does_not_matter_to_a_way():
    shown = motions(np.random.default_rng(5), 4)
    found = []
    for order in permutations(shown):
        (way,) = way_list(list(order))
        found.append(model_of(way, SPACE, LAMBDA_M, 1e-5 * np.eye(3)).course(np.full((1, 3), 0.4)))
    assert np.ptp(np.stack(found), axis=0).max() < 1e-12


def way_list(shown: list[WholeMotion]) -> tuple[WayStatistics, ...]:
    ways: tuple[WayStatistics, ...] = ()
    for motion in shown:
        ways = joined(ways, motion, SPACE, LAMBDA_M)
    return ways


def test_demonstrations_of_two_ways_make_two():
    shown = motions(np.random.default_rng(6), 8)
    mirrored = [
        m if k % 2 else WholeMotion(m.points * [1.0, -4.0, 1.0], m.time_shares, m.duration_s, m.terminal)
        for k, m in enumerate(shown)
    ]
    assert sorted(way.n for way in way_list(mirrored)) == [4, 4]
    assert [way.n for way in way_list(shown)] == [8]


def test_one_demonstration_is_warped_from_its_start_to_its_end():
    (motion,) = motions(np.random.default_rng(7), 1)
    way = model_of(way_of([motion]), SPACE, LAMBDA_M, 1e-5 * np.eye(3))
    step = np.array([0.02, -0.03, 0.01])
    moved = way.course(motion.points[:, 0] + step) - way.course(motion.points[:, 0])
    np.testing.assert_allclose(way.course(motion.points[:, 0]), motion.points, atol=1e-12)
    coarse = np.linspace(0.0, 1.0, N_COARSE + 1)
    np.testing.assert_allclose(moved[0, COARSE], (1.0 - coarse)[:, None] ** 2 * step, atol=1e-9)


def test_where_all_demonstrations_agree_the_start_has_no_say():
    shown = motions(np.random.default_rng(8), 6)
    way = model_of(way_of(shown), SPACE, LAMBDA_M, 1e-5 * np.eye(3))
    here, there = (way.course(way.points[:, 0] + [[0.0, 0.0, z]]) for z in (0.0, 0.1))
    assert np.abs(here[0, -1] - there[0, -1]).max() == 0.0
    assert np.abs(way.gains[0, -2]).max() < 0.02  # 2 mm of starts that spread by 6 cm
    assert np.abs(way.gains[0, 1] - 0.77 * np.eye(3)).max() < 0.1  # (7/8)^2


@settings(deadline=None, derandomize=True, max_examples=15)
@given(seed=seeds)
def test_the_regression_approaches_the_true_one_with_many_demonstrations(seed: int):
    """Of motions that are linear in their starts, with 2 mm of noise; least squares knows it as well."""
    random, n = np.random.default_rng(seed), 60
    phase = np.linspace(0.0, 1.0, N_PHASES + 1)[:, None]
    true = random.normal(0.0, 0.3, (3, 3))
    shown = []
    for _ in range(n):
        e = random.uniform(-0.1, 0.1, 3)
        points = (1 - phase) * (np.array([0.4, 0.1, 0.3]) + e) + phase * (1 - phase) * (true @ e)
        points[1:-1] += 0.002 * random.normal(size=points[1:-1].shape)
        shown.append(WholeMotion(points[None], phase[:, 0], 5.0, 0))
    way = model_of(way_of(shown), SPACE, LAMBDA_M, 1e-5 * np.eye(3))
    np.testing.assert_allclose(way.gains[0, N_COARSE // 2], 0.5 * np.eye(3) + 0.25 * true, atol=0.06)


@pytest.mark.parametrize("space", [Manifold(2), POSE])
def test_a_sketch_keeps_the_course_of_a_motion_of_any_length(space: Manifold):
    """A way of 40 lambda, seven thousand datapoints: within a fiftieth of lambda of every mean point's own place."""
    random, n = np.random.default_rng(9), 7000
    points = pose_stroke(random, n, noise=0.0) if space.oriented else stroke(random, 2, n, noise=0.0)
    learner = OnlineLearner(LearnerSettings(0.02), space)
    learner.start()
    learner.observe_many(points, [TaskFrame.identity(space.n_dims)], 0.001 * np.arange(float(n)))
    learner.end()
    (way,) = learner.model().ways
    apart = [space.distance(points, x, metres_per_radian=0.02).min() for x in way.points[0]]
    assert max(apart) < 0.02 * 0.02 * 16  # the spacing has doubled a few times
    np.testing.assert_allclose(way.points[0, 0], points[0], atol=1e-12)
    assert space.distance(points[-1], way.points[0, -1], metres_per_radian=0.02) < 1e-6
    assert np.isclose(way.duration_s, 0.001 * (n - 1))


def test_what_is_remembered_does_not_grow_with_the_demonstrations():
    random, sizes = np.random.default_rng(10), []
    learner = OnlineLearner(LearnerSettings(0.3), 2)
    for _ in range(20):
        learner.start()
        points = np.linspace([1.0, 0.2], [0.0, 0.0], 100) + 0.02 * random.normal(size=2)
        learner.observe_many(points, [TaskFrame.identity(2)], 0.02 * np.arange(100.0))
        learner.end()
        sizes.append(sum(array.nbytes for array in learner.snapshot().arrays()))
    assert len(set(sizes[1:])) == 1


def test_between_the_coarse_phases_values_are_theirs_and_monotone():
    values = np.array([1.0, 0.9, 0.5, 0.45, 0.2, 0.1, 0.05, 0.0, 0.0])
    for smooth in (False, True):
        fine = between_coarse(values, axis=0, smooth=smooth)
        np.testing.assert_allclose(fine[COARSE], values, atol=1e-14)
        assert (np.diff(fine) <= 1e-15).all()


@pytest.mark.parametrize("n", [5, 8])
def test_starts_outside_of_what_was_shown_are_told_from_those_inside(n: int):
    """Starts of people spread normally; those tried lie anywhere within two, or from four to eight, spreads."""
    random, inside, outside = np.random.default_rng(n), [], []
    phase = np.linspace(0.0, 1.0, N_PHASES + 1)[:, None]
    for _ in range(60):
        centre, spread = np.array([0.4, 0.1, 0.3]), 0.1
        starts = centre + spread * random.normal(size=(n, 3))
        shown = [WholeMotion(((1 - phase) * s)[None], phase[:, 0], 5.0, 0) for s in starts]
        ways = (model_of(way_of(shown), SPACE, LAMBDA_M, 1e-5 * np.eye(3)),)
        for found, least, most in ((inside, 0.0, 2.0), (outside, 4.0, 8.0)):
            direction = random.normal(size=(10, 3))
            direction /= np.linalg.norm(direction, axis=1, keepdims=True)
            away = random.uniform(least, most, (10, 1)) * np.sqrt(3.0) * spread
            frames = [TaskFrame.identity(3)]
            found += [
                distance_from_taught(ways, centre + x, frames, LAMBDA_M)[0] > OUTSIDE
                for x in away * direction
            ]
    assert np.mean(outside) >= 0.95
    assert np.mean(inside) <= 0.02


@pytest.mark.parametrize("moved", ["start", "handle"])
def test_scenes_outside_of_what_was_shown_are_told_by_the_frame_that_sees_it(moved: str):
    """Two frames, from the base's origin to the handle's, which people put here and there; now one of them is far away."""
    random, phase = np.random.default_rng(4), np.linspace(0.0, 1.0, N_PHASES + 1)[:, None]
    spread, middle, n_inside, n_outside = 0.1, np.array([0.8, 0.3, 0.0]), 0, 0
    for _ in range(100):
        shown = []
        for _ in range(6):
            start, handle = spread * random.normal(size=3), middle + spread * random.normal(size=3)
            points = start + phase * (handle - start)
            shown.append(WholeMotion(np.stack([points, points - handle]), phase[:, 0], 5.0, 0))
        ways = (model_of(way_of(shown), SPACE, LAMBDA_M, 1e-5 * np.eye(3)),)
        for least, most in ((0.0, 2.0), (4.0, 8.0)):
            direction = random.normal(size=3)
            away = random.uniform(least, most) * np.sqrt(3.0) * spread * direction / np.linalg.norm(direction)
            start, handle = (away, middle) if moved == "start" else (np.zeros(3), middle + away)
            frames = [TaskFrame.identity(3), TaskFrame(np.eye(3), handle)]
            far, frame = distance_from_taught(ways, start, frames, LAMBDA_M)
            if most == 2.0:
                n_inside += far > OUTSIDE
            else:
                n_outside += far > OUTSIDE and frame in ((0,) if moved == "start" else (0, 1))
    assert n_outside >= 95
    assert n_inside <= 2
