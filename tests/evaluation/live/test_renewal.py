"""Both kinds of changed certificates by the study's own code, one job each, and what its rules reject."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from farhand.evaluation.live.renewal import KINDS, Case, job, summarise

GOOD = {"seed": 1, "finished": True, "left": [], "out_s": 0.3, "said": "operator was revoked on a day", "why": ""}  # fmt: skip


def test_an_execution_goes_on_to_its_end_while_certificates_are_renewed_or_the_operator_is_revoked():
    with ThreadPoolExecutor(len(KINDS)) as pool:
        jobs = list(pool.map(lambda kind: job(kind, 5), KINDS))
    for kind, found in zip(KINDS, jobs, strict=True):
        assert found["finished"] and not found["left"], (kind, found)
    assert "operator was revoked on" in jobs[1]["said"]
    assert jobs[1]["out_s"] is not None


@pytest.mark.parametrize(
    ("changed", "passes"),
    [({}, True), ({"out_s": 1.1}, False), ({"said": "not answered"}, False), ({"left": ["stopped"]}, False),
     ({"finished": False}, False), ({"why": "no link"}, False)],
)  # fmt: skip
def test_one_job_in_which_a_rule_does_not_hold_fails_the_study(changed: Case, passes: bool):
    summary, _ = summarise([{"kind": "revoked", "jobs": [GOOD, {**GOOD, **changed}]}])
    assert summary["passed"] is passes
