"""The scatter of the delay against theory. Tolerances are four standard errors of the estimate, or exact."""

from __future__ import annotations

import math
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from farhand.common.impairment.delay_line import Jitter
from farhand.common.impairment.impairment import DirectionSettings, Distribution

N = 20_000
DISTRIBUTIONS = ("uniform", "normal", "pareto", "paretonormal")


def deviates(distribution: Distribution, correlation: float = 0.0, n: int = N) -> np.ndarray:
    """Delays in units of the jitter around the mean, far from being cut off at zero."""
    direction = DirectionSettings(
        delay_ms=1000, jitter_ms=10, distribution=distribution, correlation=correlation
    )
    jitter = Jitter(Random(5))
    return np.array([(1000 * jitter.draw_s(direction) - 1000) / 10 for _ in range(n)])


@pytest.mark.parametrize(
    ("distribution", "deviation"),
    # A normal deviate held between +-3 keeps 0.98654 of its standard deviation.
    [("uniform", 1 / math.sqrt(3)), ("normal", 0.99752), ("pareto", 1.0), ("paretonormal", 1.0)],
)
def test_the_mean_is_the_delay_and_the_deviation_the_jitter(distribution, deviation):
    drawn = deviates(distribution)
    assert np.mean(drawn) == pytest.approx(0.0, abs=4 * deviation / math.sqrt(N))
    kurtosis = float(stats.kurtosis(drawn, fisher=False))
    assert np.std(drawn) == pytest.approx(deviation, rel=4 * math.sqrt((kurtosis - 1) / (4 * N)))


def test_the_distributions_are_those_they_are_named_after():
    assert stats.kstest(deviates("uniform"), stats.uniform(-1, 2).cdf).pvalue > 0.001
    inside = deviates("normal")
    inside = inside[np.abs(inside) < 3 - 1e-9]
    assert stats.kstest(inside, stats.truncnorm(-3, 3).cdf).pvalue > 0.001
    pareto = 1.48 + 0.64 * deviates("pareto")  # shape 3, from 1 on, held below 5
    assert pareto.min() >= 1
    assert pareto.max() <= 5 + 1e-9
    below = pareto[pareto < 5 - 1e-9]
    cdf = stats.pareto(3).cdf
    assert stats.kstest(below, lambda x: cdf(x) / cdf(5)).pvalue > 0.001


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
@pytest.mark.parametrize("correlation", [25.0, 90.0])
def test_neighbours_have_the_rank_correlation_asked_for_and_the_distribution_stays(distribution, correlation):
    drawn = deviates(distribution, correlation)
    ranks = np.corrcoef(stats.rankdata(drawn[:-1]), stats.rankdata(drawn[1:]))[0, 1]
    assert ranks == pytest.approx(correlation / 100, abs=4 / math.sqrt(N))
    apart = deviates(distribution)
    quantiles = [0.1, 0.5, 0.9]
    assert np.quantile(drawn, quantiles) == pytest.approx(np.quantile(apart, quantiles), abs=0.12)


def test_a_correlation_of_a_hundred_per_cent_draws_once():
    assert np.ptp(deviates("normal", 100.0, 50)) == pytest.approx(0.0, abs=1e-5)


@settings(deadline=None, derandomize=True, max_examples=200)
@given(
    st.floats(0, 5000), st.floats(0, 1), st.sampled_from(DISTRIBUTIONS), st.floats(0, 100), st.integers(0, 99)
)
def test_no_delay_is_ever_negative_and_the_seed_fixes_them_all(
    delay_ms, share, distribution, correlation, seed
):
    direction = DirectionSettings(
        delay_ms=delay_ms, jitter_ms=delay_ms * share, distribution=distribution, correlation=correlation
    )
    sequences = [
        [jitter.draw_s(direction) for _ in range(20)]
        for jitter in (Jitter(Random(seed)), Jitter(Random(seed)))
    ]
    assert sequences[0] == sequences[1]
    assert min(sequences[0]) >= 0
