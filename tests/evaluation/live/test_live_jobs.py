"""What the studies of the whole hot-stab say of their jobs; one job itself: `tests/integration`."""

from __future__ import annotations

import math

import pytest

from farhand.common.errors import ProcessFailed
from farhand.evaluation.live import hot_stab_cuts, hot_stab_links, hot_stab_live, live_jobs
from farhand.evaluation.live.live_jobs import Case, job, run_jobs


def done(case: Case, depth_m: float = 0.084, sha256: str = "a") -> Case:
    execution = {
        "duration_s": 9.0, "depth_m": depth_m, "lateral_m": 0.001, "peak_force_n": 70.0, "holding_force_n": 20.0,
        "control_overruns": 3,
    }  # fmt: skip
    return {
        **case,
        "success": True,
        "why": "",
        "execution": execution,
        "model_sha256": sha256,
        "took_s": 60.0,
    }


def failed(case: Case) -> Case:
    return {**case, "success": False, "why": "the robot was eaten"}


def result(jobs: list[Case]) -> list[Case]:
    return [{"jobs": jobs, "scheduling": "niceness 0", "load": 1.0}]


def test_seeds_are_counted_once_and_two_of_one_seed_are_compared():
    (case,) = hot_stab_live.cases(4, 2)
    assert [each["seed"] for each in case["jobs"]] == [200, 201, 202, 203, 200, 201, 202]
    jobs = [done(each) for each in case["jobs"]]
    jobs[3], jobs[4] = failed(jobs[3]), done(jobs[4], depth_m=0.0845)
    summary, text = hot_stab_live.summarise(result(jobs))
    assert (summary["jobs"], summary["success_rate"], summary["failed_seeds"]) == (4, 0.75, [203])
    assert summary["same_verdict_and_model"] and math.isclose(summary["same_seed_ends_apart_m"], 5e-4)
    assert "3 of 4" in text and "seed 203, geo, none: the robot was eaten" in text
    jobs[5] = done(jobs[5], sha256="b")
    assert not hot_stab_live.summarise(result(jobs))[0]["same_verdict_and_model"]


def test_cuts_and_links_are_counted_by_kind():
    (case,) = hot_stab_cuts.cases(2, 0)
    jobs = [done(each) for each in case["jobs"]]
    jobs[1] = failed(jobs[1])
    summary, text = hot_stab_cuts.summarise(result(jobs))
    assert summary["done"] == {"stall": 2, "reset": 1, "blackhole": 2} and summary["done_together"] == 5
    assert "reset:20: the robot was eaten" in text
    (case,) = hot_stab_links.cases(1, 0)
    summary, text = hot_stab_links.summarise(result([done(each) for each in case["jobs"]]))
    assert summary["jobs"] == summary["done"] == 6 and "| `acoustic` | 1 of 1" in text


def test_a_job_that_says_no_result_failed_in_its_own_words(monkeypatch: pytest.MonkeyPatch):
    class NoSites:
        def __init__(self, *_: object, **__: object):
            raise ProcessFailed("no more ports")

    monkeypatch.setattr(live_jobs, "RealSites", NoSites)
    (only,) = run_jobs([job("hot-stab", 7, outage="stall:20")])["jobs"]
    assert (only["success"], only["why"], only["seed"]) == (False, "no more ports", 7)
