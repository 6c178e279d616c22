from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binomtest

from farhand.evaluation.metrics.tables import wilson_interval


@settings(deadline=None, derandomize=True, max_examples=200)
@given(st.integers(1, 500).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_it_is_scipys_interval(counts):
    successes, trials = counts
    expected = binomtest(successes, trials).proportion_ci(0.95, method="wilson")
    assert wilson_interval(successes, trials) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_another_confidence_gives_another_width():
    expected = binomtest(13, 15).proportion_ci(0.99, method="wilson")
    assert wilson_interval(13, 15, z=2.5758293035489004) == pytest.approx((expected.low, expected.high))


def test_the_rate_is_inside_even_at_the_ends_and_no_trials_say_nothing():
    assert wilson_interval(0, 20)[0] == 0.0
    assert wilson_interval(20, 20)[1] == 1.0
    assert wilson_interval(0, 0) == (0.0, 1.0)


@pytest.mark.parametrize("counts", [(-1, 3), (4, 3), (0, -1)])
def test_impossible_counts_are_refused(counts):
    with pytest.raises(ValueError, match="successes"):
        wilson_interval(*counts)
