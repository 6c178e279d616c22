"""Loss against the theory of its Markov chain. Tolerances are four standard errors of the estimate."""

from __future__ import annotations

import itertools
import math
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.impairment.burst_loss import Loss
from farhand.common.impairment.impairment import DirectionSettings

N = 40_000


def run(direction: DirectionSettings, n: int = N, seed: int = 1) -> list[bool]:
    """Which of so many messages are lost."""
    loss = Loss(direction, Random(seed))
    return [loss.is_lost() for _ in range(n)]


def bursts(lost: list[bool]) -> list[int]:
    """Lengths of the runs of lost messages."""
    return [len(list(group)) for is_lost, group in itertools.groupby(lost) if is_lost]


def test_nothing_is_lost_where_nothing_is_set_and_all_where_all_is():
    assert not any(run(DirectionSettings(), 100))
    assert all(run(DirectionSettings(loss=100), 100))


@pytest.mark.parametrize("correlation", [0.0, 30.0, 80.0])
def test_the_share_and_the_correlation_are_those_asked_for(correlation):
    share, r = 0.1, correlation / 100
    lost = run(DirectionSettings(loss=10, loss_correlation=correlation))
    # A chain with correlation r has the variance of an independent one times (1 + r) / (1 - r).
    error = math.sqrt(share * (1 - share) / N * (1 + r) / (1 - r))
    assert sum(lost) / N == pytest.approx(share, abs=4 * error)
    after_loss = [second for first, second in itertools.pairwise(lost) if first]
    p_again = share + r * (1 - share)
    assert sum(after_loss) / len(after_loss) == pytest.approx(
        p_again, abs=4 * math.sqrt(p_again * (1 - p_again) / len(after_loss))
    )


def test_gilberts_bursts_last_as_long_as_theory_says():
    p, r = 0.02, 0.25
    lost = run(DirectionSettings(gemodel_p=100 * p, gemodel_r=100 * r))
    lengths = bursts(lost)
    # Geometric: mean 1 / r, variance (1 - r) / r^2. Bursts begin at a rate of p r / (p + r).
    mean = sum(lengths) / len(lengths)
    assert mean == pytest.approx(1 / r, abs=4 * math.sqrt((1 - r) / r**2 / len(lengths)))
    assert len(lengths) / N == pytest.approx(p * r / (p + r), rel=4 / math.sqrt(len(lengths)))


def test_elliotts_two_conditions_lose_their_own_shares():
    direction = DirectionSettings(gemodel_p=5, gemodel_r=20, gemodel_1_h=60, gemodel_1_k=2)
    bad = 0.05 / 0.25
    share = bad * 0.6 + (1 - bad) * 0.02
    memory = 1 - 0.05 - 0.20
    error = math.sqrt(share * (1 - share) / N * (1 + memory) / (1 - memory))  # an upper bound of it
    assert sum(run(direction)) / N == pytest.approx(share, abs=4 * error)


def test_a_change_takes_effect_at_once_and_a_lasting_burst_goes_on():
    loss = Loss(DirectionSettings(gemodel_p=100, gemodel_r=1e-9), Random(0))
    assert [loss.is_lost() for _ in range(3)] == [True] * 3
    loss.change(DirectionSettings(gemodel_p=1e-9, gemodel_r=1e-9))
    assert loss.is_lost()
    loss.change(DirectionSettings())
    assert not loss.is_lost()


@settings(deadline=None, derandomize=True, max_examples=100)
@given(st.floats(0, 100), st.floats(0, 99.9), st.integers(0, 99))
def test_the_same_seed_loses_the_same_messages(share, correlation, seed):
    direction = DirectionSettings(loss=share, loss_correlation=correlation)
    assert run(direction, 50, seed) == run(direction, 50, seed)
