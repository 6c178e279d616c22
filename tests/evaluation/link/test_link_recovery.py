from __future__ import annotations

import pytest

from farhand.evaluation.link import link_recovery


def test_the_limits_are_those_that_were_promised():
    assert link_recovery.limit_s("stall", 0.3) == pytest.approx(0.55)
    assert link_recovery.limit_s("reset", 0.3) == pytest.approx(3.3)
    assert link_recovery.limit_s("restart of the robot's site", 1.0) == pytest.approx(7.5)


def test_the_worst_is_held_against_the_limit():
    def result(*took_s: float) -> list[link_recovery.Case]:
        return [
            {
                "recoveries": [{"delay_s": 0.0, "what": "stall", "took_s": list(took_s)}],
                "scheduling": "niceness 0",
                "load": 1.5,
            }
        ]

    assert link_recovery.summarise(result(0.01, 0.25))[0]["passed"]
    summary, markdown = link_recovery.summarise(result(0.01, 0.02, 0.26))
    assert not summary["passed"]
    assert "NOT every one" in markdown and "| stall | 0 | 0.020 | 0.260 | 0.25 | 3 |" in markdown


def test_fresh_data_comes_back_after_every_outage_and_restart_of_real_processes(monkeypatch):
    monkeypatch.setattr(link_recovery, "DELAYS_S", (0.05,))
    monkeypatch.setattr(link_recovery, "_OUTAGE_S", 1.0)
    recoveries = link_recovery.trial({"repeats": 1})["recoveries"]
    assert [each["what"] for each in recoveries] == list(link_recovery.RECOVERIES)
    assert all(took_s > 0.0 for each in recoveries for took_s in each["took_s"])
