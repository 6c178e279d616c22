from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray

from farhand.evaluation.metrics.motion_metrics import dtw_rms, resampled_by_length
from tests.strategies import seeds, stroke

Array = NDArray[np.float64]


def naive_dtw_rms(one: Array, other: Array) -> float:
    """The textbook's table: the cheapest way to each pair, as (sum of squares, number of pairs)."""
    a, b = resampled_by_length(one), resampled_by_length(other)
    squares = ((a[:, None] - b[None]) ** 2).sum(axis=2).tolist()
    ways = {(-1, -1): (0.0, 0)}
    for i in range(len(a)):
        for j in range(len(b)):
            before = [ways[at] for at in ((i - 1, j - 1), (i - 1, j), (i, j - 1)) if at in ways]
            cost, length = min(before)
            ways[i, j] = (cost + squares[i][j], length + 1)
    cost, length = ways[len(a) - 1, len(b) - 1]
    return (cost / length) ** 0.5


@pytest.mark.parametrize("n_dims", [2, 3])
def test_it_is_what_the_textbooks_table_says(n_dims):
    rng = np.random.default_rng(0)
    for n, m in ((50, 50), (30, 170), (400, 7)):
        one, other = stroke(rng, n_dims, n), stroke(rng, n_dims, m)
        assert dtw_rms(one, other) == pytest.approx(naive_dtw_rms(one, other), rel=1e-12)


@settings(deadline=None, derandomize=True, max_examples=30)
@given(seeds)
def test_no_motion_is_away_from_itself_and_the_order_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    one, other = stroke(rng, 2, 60), stroke(rng, 2, 80)
    assert dtw_rms(one, one) == 0.0
    assert dtw_rms(one, other) == pytest.approx(dtw_rms(other, one), rel=1e-9)


@settings(deadline=None, derandomize=True, max_examples=30)
@given(seeds)
def test_it_is_never_more_than_the_distance_point_by_point(seed):
    rng = np.random.default_rng(seed)
    one, other = stroke(rng, 2, 60), stroke(rng, 2, 80)
    apart = np.linalg.norm(resampled_by_length(one) - resampled_by_length(other), axis=1)
    assert dtw_rms(one, other) <= np.sqrt(np.mean(apart**2)) + 1e-12


def test_the_timing_of_a_motion_does_not_matter():
    path = stroke(np.random.default_rng(1), 2, 2000, noise=0.0)
    hurried, dawdling = path[::7], np.repeat(path, 3, axis=0)
    assert dtw_rms(path[::7], dawdling) < 1e-3
    assert dtw_rms(hurried, path) < 1e-3


def test_a_parallel_line_is_as_far_away_as_it_is_apart():
    line = np.linspace([0.0, 0.0], [1.0, 0.0], 30)
    assert dtw_rms(line, line + np.array([0.0, 0.25])) == pytest.approx(0.25)


def test_resampled_points_are_equally_far_apart_along_the_path():
    angle = np.linspace(0.0, np.pi, 2000) ** 2 / np.pi  # a half circle, faster and faster
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = resampled_by_length(circle, 50)
    even = np.linspace(0.0, np.pi, 50)
    np.testing.assert_allclose(points, np.stack([np.cos(even), np.sin(even)], axis=1), atol=1e-5)
    np.testing.assert_array_equal(points[[0, -1]], circle[[0, -1]])
