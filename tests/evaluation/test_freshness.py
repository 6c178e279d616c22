"""One per cent of the study of freshness, and its parts."""

from __future__ import annotations

import pytest

from evaluation import freshness
from evaluation.freshness import CLOCKS, DELAYS_S, RULES
from evaluation.stamp_rule import StampRule


@pytest.fixture(scope="module")
def results() -> list[dict]:
    cases = {(case["delay_s"], case["clocks"]): case for case in freshness.cases(None, 0)}
    return [freshness.trial(cases[0.3, clocks]) for clocks in ("ahead by an hour", "behind by an hour")]


def test_every_delay_is_driven_at_with_every_state_of_the_clocks_by_ever_new_seeds():
    cases = freshness.cases(None, 0)
    assert {(c["delay_s"], c["clocks"]) for c in cases} == {(d, c) for d in DELAYS_S for c in CLOCKS}
    assert len({c["seed"] for c in cases}) == len(cases) == 200
    assert freshness.cases(2, 0) == cases[:2]


def test_by_the_robots_own_clock_nothing_stale_moves_and_nothing_fresh_is_refused(results):
    for result in results:
        assert result["n_inputs"] > 3000 and result["n_replayed"] >= 300
        assert result["stale"]["ours"] == result["refused"]["ours"] == 0
        assert result["n_couplings"] == 3


def test_by_two_wall_clocks_stale_inputs_move_or_fresh_ones_are_refused(results):
    ahead, behind = results
    for rule in RULES[1:]:
        assert ahead["stale"][rule] > 50
        assert behind["refused"][rule] > 1000


def test_the_summary_counts_what_each_rule_did_wrong(results):
    summary, text = freshness.summarise(results)
    assert summary["stale_motions"]["0.5 s"] == sum(r["stale"]["0.5 s"] for r in results)
    assert summary["success_rate"] == 1.0
    assert "| all (2 drives) | 0 / 0 |" in text


def test_a_stamp_counts_while_it_is_young_and_new():
    rule = StampRule(0.5)
    assert rule.accepts(1, 10.0, 10.5)
    assert not rule.accepts(1, 10.0, 10.1) and not rule.accepts(2, 10.0, 10.6)
    assert rule.accepts(3, 99.0, 10.0)  # a stamp of the future is never old: its fault
    rule.restart()
    assert rule.accepts(1, 10.0, 10.0)
