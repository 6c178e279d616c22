"""A fiftieth of the study of STOP's way; the whole of it is `farhand evaluate stop-lane`."""

from __future__ import annotations

from farhand.evaluation.live import stop_lane


def test_stop_overtakes_a_console_that_learns_writes_and_waits_for_the_arm():
    result = stop_lane.trial({"block": "does all of it", "presses": 2, "seed": 1})
    assert result["blocked"] == [True, True] and result["blocked_s"] >= 5.0
    # The limit is the best press's: a busy machine may hold up one, but none for as long as the console.
    assert min(result["took_s"]) <= stop_lane.LIMIT_S and max(result["took_s"]) < 1.0


def test_a_press_that_came_too_late_fails_the_study():
    cases = stop_lane.cases(None, 0)
    assert sum(case["presses"] for case in cases) == 100
    assert {case["block"] for case in cases} == set(stop_lane.BLOCKS)
    good = [{**case, "took_s": [0.002] * 5, "blocked": [True] * 5} for case in cases]
    summary, markdown = stop_lane.summarise(good)
    assert summary["passed"] and "100 of 100" in markdown
    good[3]["took_s"] = [0.002] * 4 + [0.051]
    summary, markdown = stop_lane.summarise(good)
    assert not summary["passed"] and "99 of 100" in markdown
