"""One per cent of the study of cuts, and how it counts."""

from __future__ import annotations

import pytest

from evaluation import cuts
from evaluation.cuts import KINDS


@pytest.fixture(scope="module")
def results() -> list[dict]:
    return [cuts.trial(case) for case in cuts.cases(2, 7)]


def test_cuts_are_of_every_kind_at_any_moment_and_one_in_ten_is_real():
    real, *virtual = cuts.cases(None, 0)
    assert len(virtual) == 200 and real["real"] == virtual[:20]
    assert {case["kind"] for case in virtual} == set(KINDS)
    assert min(case["at"] for case in virtual) < 0.05 and max(case["at"] for case in virtual) > 0.95
    assert all(1.0 <= case["duration_s"] <= 60.0 for case in virtual)
    assert len({case["seed"] for case in virtual}) == 200


def test_a_job_that_succeeds_uncut_succeeds_with_the_cut(results):
    for result in results:
        assert result["uncut"]["success"] and result["cut"]["success"] and not result["lost"]
        # The cut was there: the job took about as much longer as the link was away.
        longer_s = result["cut"]["ended_s"] - result["uncut"]["ended_s"]
        assert longer_s > result["duration_s"] - 15.0


def test_only_what_succeeds_uncut_can_be_lost(results):
    unlucky = {**results[0], "uncut": {"success": False, "why": "-"}}
    lost = {**results[0], "lost": True, "cut": {"success": False, "why": "it stands still"}}
    summary, text = cuts.summarise([*results, unlucky, lost])
    assert (summary["trials"], summary["succeed_uncut"], summary["lost"]) == (4, 3, 1)
    assert "it stands still" in text and "| all | 2 of 3 = 66.7 %" in text


def test_a_real_job_that_fails_is_a_failure():
    done = {"seed": 1, "kind": "stall", "duration_s": 1.0, "cut": {"success": True}}
    failed = {**done, "cut": {"success": False, "why": "no arrival"}}
    assert cuts.summarise([{"real": [done]}])[0]["passed"]
    summary, text = cuts.summarise([{"real": [done, failed]}])
    assert not summary["passed"] and summary["real_failed"] == 1 and "no arrival" in text
