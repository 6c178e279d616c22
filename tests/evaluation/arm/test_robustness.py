from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from farhand.evaluation.arm import robustness
from farhand.evaluation.arm.arm_trial import Conditions
from farhand.evaluation.study import chosen, reporting_seeds, tuning_seeds
from farhand.evaluation.study_record import plain
from farhand.remote_site.perception.simulated_sight import TYPICAL


def test_what_an_exact_tracker_mends_failed_for_want_of_perception(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    blind = Conditions(noise=replace(TYPICAL, bias_m=0.08), attempts=0)
    monkeypatch.setitem(robustness.SCENARIOS, "sway 20 mm, 0.1 Hz", (blind, 0.97))
    cases = robustness.cases(1, 7)
    (case,) = [case for case in cases if case["scenario"] == "sway 20 mm, 0.1 Hz"]
    failed = robustness.trial(case)
    assert not failed["success"] and failed["exact_success"] and failed["cause"]
    # The other scenarios would find nothing here that the study itself does not: all that is tested is the record.
    good = {**failed, "success": True, "cause": ""}
    results = [failed if one is case else {**good, **one} for one in cases]
    summary, markdown = robustness.summarise(results)
    json.dumps(plain({"trials": results, "summary": summary}), allow_nan=False)
    assert summary["sway 20 mm, 0.1 Hz"]["failed_for_want_of_perception"] == 1
    assert summary["sway 50 mm, 0.2 Hz"]["success_rate"] == 1.0
    assert len(summary["grid"]) == 36 and "| 1 of 1 |" in markdown
    (figure,) = robustness.draw(results, tmp_path)
    assert (tmp_path / figure).read_bytes().startswith(b"\x89PNG")

    part = chosen(results, "required")
    summary, markdown = robustness.summarise(part)
    assert (
        "grid" not in summary
        and "wide box" not in summary
        and all(each["required"] for each in summary.values())
    )
    assert markdown.startswith("# ") and robustness.draw(part, tmp_path) == []
    assert robustness.summarise(chosen(results, "grid"))[1].startswith("# ")


def test_jumps_come_at_all_distances_before_the_mouth():
    cases = [case for case in robustness.cases(20, 0) if case["scenario"] == "jump 10 cm"]
    at_m = [robustness.conditions_of(case).jump_within_m or 0.0 for case in cases]
    assert 0.035 <= min(at_m) < 0.06 and 0.11 < max(at_m) <= 0.135


def test_the_grid_is_seen_by_three_robots_that_differ_in_touch_alone():
    grid = [case for case in robustness.cases(5, 0) if case["scenario"] == "grid"]
    seeds = {case["seed"] for case in grid}
    assert len(grid) == 36 * len(seeds) == 36
    conditions = [robustness.conditions_of(case) for case in grid]
    assert len({(c.compliance, c.correcting, c.attempts) for c in conditions}) == 3
    assert seeds <= set(reporting_seeds(0, 100)) and seeds.isdisjoint(tuning_seeds(0, 10_000))
