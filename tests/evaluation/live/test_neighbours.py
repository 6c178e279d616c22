"""A hundredth of the study of bad neighbours, with its own code and real processes."""

from __future__ import annotations

import pytest

from farhand.evaluation.live import neighbours


@pytest.mark.parametrize("neighbour", ["models of 3.8 MB", "who reads nothing"])
def test_every_stop_is_acknowledged_beside_a_bad_neighbour(neighbour: str):
    (case,) = [each for each in neighbours.cases(3, seed=0) if each["neighbour"] == neighbour]
    assert case["duration_s"] == 3.0
    result = neighbours.trial(case)
    assert len(result["took_s"]) == neighbours.STOPS and None not in result["took_s"]
    assert result["robot"][-1]["n"] > 0 and result["peer"][-1]["n"] > 0
    summary, text = neighbours.summarise([result])
    assert neighbour in text and "idle peers" in text
    assert isinstance(summary["passed"], bool)


def test_a_stop_that_nobody_acknowledged_is_no_success():
    line = {"n": 10, "overruns": 0, "late_p99_ms": 1.0, "late_max_ms": 25.0}
    good = {
        "neighbour": "x",
        "duration_s": 3.0,
        "took_s": [0.01] * 100,
        "robot": [line],
        "peer": [line],
        "load": 1.0,
    }
    assert neighbours.summarise([good])[0] == {"passed": True, "later_than_limit_ms": {"x": 25.0}}
    summary, text = neighbours.summarise([{**good, "took_s": [0.01] * 99 + [None]}])
    assert not summary["passed"] and "99 of 100" in text
