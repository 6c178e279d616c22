"""One per cent of the study of freshness, and its parts."""

from __future__ import annotations

from itertools import product

import pytest

from farhand.evaluation.link import freshness, silence
from farhand.evaluation.link.freshness import CLOCKS, DELAYS_S, RULES
from farhand.evaluation.link.freshness_world import StampRule
from farhand.remote_site.motion import coupling


@pytest.fixture(scope="module")
def results() -> list[dict]:
    cases = {(case["delay_s"], case["clocks"]): case for case in freshness.cases(None, 0)[:200]}
    return [freshness.trial(cases[0.3, clocks]) for clocks in ("ahead by an hour", "behind by an hour")]


def test_every_delay_is_driven_at_with_every_state_of_the_clocks_by_ever_new_seeds():
    cases = freshness.cases(None, 0)
    drives, silences = cases[:200], cases[200:]
    assert {(c["delay_s"], c["clocks"]) for c in drives} == {(d, c) for d in DELAYS_S for c in CLOCKS}
    assert {(c["silence"], c["delay_s"]) for c in silences} == set(product(silence.KINDS, silence.DELAYS_S))
    for part in (drives, silences):
        assert len({c["seed"] for c in part}) == len(part)
    assert freshness.cases(2, 0) == drives[:2] + silences[:6]


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


def test_when_nothing_is_heard_the_robot_that_was_driven_stands_in_time_and_stays():
    short = [case for case in silence.cases(30, 0) if case["delay_s"] == 0.3]
    assert {case["silence"] for case in short} == set(silence.KINDS)
    results = [silence.trial(case) for case in short]
    for result in results:
        assert result["coupled"] and result["speed_m_s"] > 0.1
        assert 0.3 < result["stood_after_s"] <= silence.LIMIT_S
        assert result["mode"] == "HOLD"
    summary, text = silence.summarise(results)
    assert summary["passed"] and "| all | 6 of 6" in text


def test_a_robot_that_goes_on_without_input_is_found_out(monkeypatch):
    monkeypatch.setattr(coupling, "INPUT_SILENCE_S", 1.0)
    case = next(case for case in silence.cases(30, 0) if case["silence"] == "no events of the page")
    assert not silence.summarise([silence.trial(case)])[0]["passed"]


def test_a_stamp_counts_while_it_is_young_and_new():
    rule = StampRule(0.5)
    assert rule.accepts(1, 10.0, 10.5)
    assert not rule.accepts(1, 10.0, 10.1) and not rule.accepts(2, 10.0, 10.6)
    assert rule.accepts(3, 99.0, 10.0)  # a stamp of the future is never old: its fault
    rule.restart()
    assert rule.accepts(1, 10.0, 10.0)
