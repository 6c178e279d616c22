"""The narrowest profile and one execution of each kind of the study of link profiles, and its parts."""

from __future__ import annotations

import pytest

from farhand.evaluation.link import link_profiles, profile_jobs, real_profiles


@pytest.fixture(scope="module")
def acoustic() -> dict:
    return link_profiles.trial({"what": "profile", "profile": "acoustic"})


def test_the_narrowest_link_carries_telemetry_models_and_a_stop(acoustic):
    for phase in acoustic["telemetry"].values():
        assert phase["rate_hz"] >= 0.5
        assert 0.67 < phase["age_p50_s"] <= phase["age_p95_s"] <= 2 * 0.67 + 3.0
    assert acoustic["stop_s"] < 2.0  # it does not wait behind the model
    for model in acoustic["models"].values():
        assert model["parts"] > 1 and model["wire_bytes"] > model["bytes"]
        # Nothing is faster than the rate, or than a round trip for each part.
        assert model["took_s"] > max(8 * model["wire_bytes"] / 9600, 2 * 0.67 * model["parts"])


def test_a_profile_that_is_too_slow_is_told(acoustic):
    executions = [link_profiles.trial({"what": kind, "seed": 1_000_000}) for kind in link_profiles.KINDS]
    assert link_profiles.summarise([acoustic, *executions])[0]["passed"]
    slow = {**acoustic, "telemetry": {"at rest": {"rate_hz": 0.4, "age_p50_s": 1.0, "age_p95_s": 2.0}}}
    summary, text = link_profiles.summarise([slow, *executions])
    assert not summary["passed"] and "NOT on every profile" in text
    for kind in link_profiles.KINDS:
        assert all(difference < 0.01 for difference in summary["precision"][kind].values())  # mm, degrees


def test_every_profile_is_measured_and_every_kind_of_model_executed():
    cases = link_profiles.cases(None, 0)
    assert [c["profile"] for c in cases if c["what"] == "profile"] == ["lan", "geo", "leo", "acoustic"]
    assert all(sum(c["what"] == kind for c in cases) == 50 for kind in link_profiles.KINDS)
    assert real_profiles.cases(None, 0) == [{"profiles": ["lan", "geo", "leo", "acoustic"]}]


def test_a_real_job_that_fails_is_told():
    job = {"success": True, "why": ""}
    kept = {
        "profile": "lan", "one_way_s": 0.1, "telemetry": {"at rest": {"rate_hz": 1.0, "age_p50_s": 1.0, "age_p95_s": 2.0}},
        "there_bytes_s": 1.0, "back_bytes_s": 2.0, "model_s": 0.1, "job": job,
    }  # fmt: skip
    machine = {"scheduling": "niceness 0", "load": 1.0}
    assert real_profiles.summarise([{"profiles": [kept], **machine}])[0]["passed"]
    failed = {**kept, "job": {"success": False, "why": "no arrival"}}
    summary, text = real_profiles.summarise([{"profiles": [kept, failed], **machine}])
    assert not summary["passed"] and "no arrival" in text and "on every profile" in text


def test_the_age_is_that_of_the_newest_report_at_each_moment():
    # Sent at 0, 1, 2 ... and 0.5 s under way: the age rises from 0.5 to 1.5 s again and again.
    regular = [(n + 0.5, float(n)) for n in range(20)]
    phase = profile_jobs.age_and_rate(regular, 2.5, 12.5)
    assert phase["rate_hz"] == pytest.approx(1.0)
    assert phase["age_p50_s"] == pytest.approx(1.0, abs=0.03)
    assert phase["age_p95_s"] == pytest.approx(1.45, abs=0.03)
    # One that was overtaken makes nothing older.
    late = [*regular[:6], (5.6, 1.5), *regular[6:]]
    assert profile_jobs.age_and_rate(late, 2.5, 12.5)["age_p95_s"] == phase["age_p95_s"]


def test_a_model_is_executed_as_learned_and_as_it_arrives():
    found = link_profiles.compare("poses", 3)
    assert found["single_bytes"] < 0.5 * found["double_bytes"]
    for measure, value in found["double"].items():
        assert found["single"][measure] == pytest.approx(value, abs=0.01)
