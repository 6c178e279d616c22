"""One per cent of the study of cuts, and how it counts."""

from __future__ import annotations

import pytest

from farhand.evaluation.link import cuts, real_cuts
from farhand.evaluation.link.cuts import KINDS


@pytest.fixture(scope="module")
def results() -> list[dict]:
    return [cuts.trial(case) for case in cuts.cases(2, 7)]


def test_cuts_are_of_every_kind_at_any_moment():
    every = cuts.cases(None, 0)
    assert len({case["seed"] for case in every}) == len(every) == 200
    assert {case["kind"] for case in every} == set(KINDS)
    assert min(case["at"] for case in every) < 0.05 and max(case["at"] for case in every) > 0.95
    assert all(1.0 <= case["duration_s"] <= 60.0 for case in every)


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
    assert "it stands still" in text and "| all | 2 of 3 = 66.7 %" in text and "fails uncut" in text


def test_a_real_job_that_fails_is_a_failure():
    assert real_cuts.cases(None, 0)[0]["jobs"] == cuts.cases(24, 0)
    done = {**cuts.cases(1, 0)[0], "cut": {"success": True, "why": ""}}
    failed = {**done, "cut": {"success": False, "why": "no arrival"}}
    machine = {"scheduling": "niceness 0", "load": 1.0}
    assert real_cuts.summarise([{"jobs": [done], **machine}])[0]["passed"]
    summary, text = real_cuts.summarise([{"jobs": [done, failed], **machine}])
    assert not summary["passed"] and summary["failed_seeds"] == [done["seed"]] and "no arrival" in text
