from __future__ import annotations

from itertools import groupby

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.local_site.learning.dwell_statistics import (
    Dwell,
    Segment,
    duration_variance,
    finish,
    follow,
    time_shares,
    transition_probabilities,
)

K, END = 4, 4
chains = st.lists(st.lists(st.integers(0, K - 1), min_size=2, max_size=30), min_size=1, max_size=5)


def counted(demonstrations: list[list[int]], dt: float = 0.5) -> Dwell:
    dwell = Dwell.empty(K + 1)
    for labels in demonstrations:
        segment = Segment.begin(K + 1)
        follow(dwell, segment, np.array(labels), dt * np.arange(len(labels)), np.zeros(len(labels), np.bool_))
        finish(dwell, segment, END)
    return dwell


@settings(deadline=None, derandomize=True, max_examples=60)
@given(chains)
def test_counts_and_durations_are_those_of_the_segments(demonstrations: list[list[int]]):
    dwell, dt = counted(demonstrations), 0.5
    durations: dict[int, list[float]] = {i: [] for i in range(K)}
    transitions, stayed_s = np.zeros((2, K + 1, K + 1))
    for labels in demonstrations:
        runs = [(i, len(list(run))) for i, run in groupby(labels)]
        for number, (i, length) in enumerate(runs):
            durations[i].append(dt * (length - (number == 0)))  # the first sample ends no interval
        for number, ((i, length), (j, _)) in enumerate(zip(runs, [*runs[1:], (END, 0)], strict=True)):
            transitions[i, j] += 1
            stayed_s[i, j] += dt * (length - (number == 0))
    np.testing.assert_array_equal(dwell.transitions, transitions)
    np.testing.assert_array_equal(dwell.stayed_s, stayed_s)
    shares = time_shares(dwell, K + 1)
    np.testing.assert_allclose(shares.sum(axis=1), stayed_s.any(axis=1), atol=1e-12)
    for i, expected in durations.items():
        assert dwell.visits[i] == len(expected)
        if expected:
            np.testing.assert_allclose(dwell.mean[i], np.mean(expected), atol=1e-12)
            np.testing.assert_allclose(dwell.m2[i], len(expected) * np.var(expected), atol=1e-10)


@settings(deadline=None, derandomize=True, max_examples=60)
@given(chains)
def test_the_sums_of_the_counts_agree(demonstrations: list[list[int]]):
    dwell = counted(demonstrations)
    assert dwell.transitions.sum() == dwell.visits.sum()  # every closed segment went somewhere
    assert dwell.ends.sum() == dwell.starts.sum() == len(demonstrations)
    total_s = sum(0.5 * (len(labels) - 1) for labels in demonstrations)
    np.testing.assert_allclose((dwell.visits * dwell.mean).sum(), total_s, atol=1e-9)
    transition, exit_probability = transition_probabilities(dwell, K + 1)
    np.testing.assert_allclose(transition.sum(axis=1) + exit_probability, 1.0, atol=1e-15)
    assert not np.diag(transition).any()


def test_phase_is_the_mean_fraction_of_the_time():
    dwell = counted([[0, 0, 1, 1, 1]], dt=0.25)
    np.testing.assert_allclose(dwell.phase_sum / np.maximum(dwell.phase_count, 1), [0.125, 0.75, 0, 0, 1.0])


def test_the_variance_of_durations_has_a_floor():
    dwell = counted([[0, 0, 0, 1, 1], [0, 0, 0, 1, 1]], dt=1.0)
    variance = duration_variance(dwell, K, 0.15, 0.02)
    np.testing.assert_allclose(variance[:2], (0.15 * np.array([2.0, 2.0])) ** 2 + 0.02**2)
    assert variance[3] == 0.02**2
