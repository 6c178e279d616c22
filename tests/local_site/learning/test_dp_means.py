from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray

from farhand.common.model.manifold import Manifold
from farhand.local_site.learning.clusters import Clusters
from farhand.local_site.learning.dp_means import FRAME_RULES, add_end, assign_points
from farhand.local_site.learning.motion import Motion
from tests.strategies import dims, frame_counts, recording, seeds

LAMBDA, WEIGHTS, HYSTERESIS = 0.2, np.array([1.0, 0.5, 1.0]), 0.1


def assigned(
    points: NDArray, times: NDArray, weights: NDArray = WEIGHTS, rule: int = 0
) -> tuple[Clusters, NDArray]:
    return assigned_with_rests(points, times, weights, rule)[:2]


def assigned_with_rests(
    points: NDArray, times: NDArray, weights: NDArray = WEIGHTS, rule: int = 0
) -> tuple[Clusters, NDArray, NDArray]:
    clusters = Clusters.empty(256, points.shape[1], Manifold(points.shape[2]))
    labels, rests = np.zeros(len(times), np.int64), np.zeros(len(times), np.bool_)
    motion = Motion.begin(points.shape[1], Manifold(points.shape[2]))
    done = assign_points(clusters, motion, points, times, LAMBDA, weights, HYSTERESIS, rule, labels, rests)
    assert done == len(times)
    return clusters, labels, rests


def in_frames(rng: np.random.Generator, n_dims: int, n_frames: int) -> tuple[NDArray, NDArray]:
    points, times = recording(rng, n_dims, 120)
    return np.stack([points + j for j in range(n_frames)], axis=1), times


@settings(deadline=None, derandomize=True, max_examples=25)
@given(seed=seeds, n_dims=dims, n_frames=frame_counts)
def test_means_and_scatters_are_the_batch_statistics_of_the_assigned_points(
    seed: int, n_dims: int, n_frames: int
):
    points, times = in_frames(np.random.default_rng(seed), n_dims, n_frames)
    clusters, labels, rests = assigned_with_rests(points, times)
    assert rests.mean() < 0.3  # at most the slow ends of the stroke
    for i in range(clusters.size[0]):
        mine = points[(labels == i) & ~rests]
        assert clusters.counts[i] == len(mine)
        for j in range(n_frames):
            np.testing.assert_allclose(clusters.means[i, j, :n_dims], mine[:, j].mean(axis=0), atol=1e-12)
            scatter = clusters.scatters[i, j, :n_dims, :n_dims]
            np.testing.assert_allclose(scatter, len(mine) * np.cov(mine[:, j].T, bias=True), atol=1e-12)


@settings(deadline=None, derandomize=True, max_examples=25)
@given(seed=seeds)
def test_every_point_was_within_lambda_of_its_component_when_assigned(seed: int):
    points, times = in_frames(np.random.default_rng(seed), 2, 1)
    _, labels = assigned(points, times, np.array([0.0, 0.0, 1.0]))
    seen: dict[int, list[NDArray]] = {}
    for point, label in zip(points[:, 0], labels, strict=True):
        if label in seen:
            assert np.linalg.norm(point - np.mean(seen[label], axis=0)) <= LAMBDA + 1e-12
        else:
            assert all(np.linalg.norm(point - np.mean(p, axis=0)) > LAMBDA - 1e-12 for p in seen.values())
        seen.setdefault(label, []).append(point)


def test_hysteresis_keeps_the_component_at_a_border():
    # two components at 0 and 0.3; then the point trembles about their middle
    line = np.array([0.0, 0.3] + [0.148, 0.152] * 20)[:, None, None]
    points = np.concatenate([line, np.zeros_like(line)], axis=2)
    _, labels = assigned(points, np.arange(float(len(line))), np.array([0.0, 0.0, 1.0]))
    assert labels[0] != labels[1]
    assert len(set(labels[2:])) == 1


def test_a_stroke_that_returns_on_itself_is_learned_in_both_directions():
    there = np.linspace(0.0, 1.0, 60)
    line = np.concatenate([there, there[::-1]])[:, None, None]
    points = np.concatenate([line, np.zeros_like(line)], axis=2)
    times = np.arange(120.0)
    _, by_position = assigned(points, times, np.array([0.0, 0.0, 1.0]))
    _, by_direction = assigned(points, times, np.array([1.0, 0.0, 1.0]))
    assert set(by_position[:55]) & set(by_position[70:])
    assert not set(by_direction[:55]) & set(by_direction[70:])


@pytest.mark.parametrize(("rule", "together"), [("all", False), ("goal", False), ("nearest", True)])
def test_one_frame_in_which_demonstrations_agree_makes_them_one_component(rule: str, together: bool):
    line = np.linspace([0.0, 0.0], [0.5, 0.0], 60)
    clusters, labels = Clusters.empty(64, 2, Manifold(2)), []
    for away in (0.0, 1.0):  # the second frame, the goal's, sees the second demonstration from elsewhere
        points, motion = np.stack([line, line + away], axis=1), Motion.begin(2, Manifold(2))
        labels.append(np.zeros(60, np.int64))
        number = FRAME_RULES.index(rule)
        assign_points(
            clusters,
            motion,
            points,
            np.arange(60.0),
            LAMBDA,
            WEIGHTS,
            HYSTERESIS,
            number,
            labels[-1],
            np.zeros(60, np.bool_),
        )
    assert (set(labels[0]) == set(labels[1])) == together
    assert bool(set(labels[0]) & set(labels[1])) == together


def test_it_stops_where_there_is_no_room_and_goes_on_from_there():
    points, times = in_frames(np.random.default_rng(3), 2, 1)
    _, whole = assigned(points, times)
    small = Clusters.empty(3, 1, Manifold(2))
    motion, labels = Motion.begin(1, Manifold(2)), np.zeros(len(times), np.int64)
    done = assign_points(
        small, motion, points, times, LAMBDA, WEIGHTS, HYSTERESIS, 0, labels, np.zeros(len(times), np.bool_)
    )
    assert small.size[0] == 3
    assert done < len(times)
    np.testing.assert_array_equal(labels[:done], whole[:done])


def test_ends_near_each_other_share_a_terminal_component():
    clusters = Clusters.empty(64, 1, Manifold(2))
    ends = []
    for last in (0.0, 0.5 * LAMBDA, 3.0 * LAMBDA):
        motion = Motion.begin(1, Manifold(2))
        points = np.linspace([[1.0, last]], [[0.0, last]], 40)
        assign_points(
            clusters,
            motion,
            points,
            np.arange(40.0),
            LAMBDA,
            WEIGHTS,
            HYSTERESIS,
            0,
            np.zeros(40, np.int64),
            np.zeros(40, np.bool_),
        )
        ends.append(add_end(clusters, motion, LAMBDA, WEIGHTS, 0))
    assert ends[0] == ends[1] != ends[2]
    assert list(np.flatnonzero(clusters.terminal)) == sorted({ends[0], ends[2]})
    np.testing.assert_allclose(clusters.means[ends[0], 0, :2], [0.0, 0.25 * LAMBDA], atol=1e-12)
