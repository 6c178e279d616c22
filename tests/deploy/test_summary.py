from __future__ import annotations

import pytest

from farhand.deploy.outcome import summary
from farhand.local_site.script.scripted_result import whole_result

RESULT = {
    "task": "planar", "success": True, "n_demonstrations": 3, "n_components": 9, "n_paths": 3, "model_bytes": 5000,
    "link": {"profile": "lan", "command_round_trip_s": 0.04, "outage": None},
    "execution": {"duration_s": 4.2, "rms_error_m": 0.005, "rms_over_s": 10.0, "board_side_m": 1.0},
}  # fmt: skip


def test_the_summary_says_how_it_went():
    text = "\n".join(summary(RESULT))
    for words in ("SUCCESS", "9 components", "5000 B", "lan", "5.0 mm (0.50 % of the board)", "4.20 s"):
        assert words in text
    assert "cut by" not in text


def test_a_failure_an_outage_and_an_unknown_error_are_said():
    failed = RESULT | {
        "success": False,
        "link": RESULT["link"] | {"outage": "stall:10"},
        "execution": RESULT["execution"] | {"rms_error_m": None},
    }
    text = "\n".join(summary(failed))
    assert "FAILED" in text and "cut by stall:10" in text and "unknown" in text


def test_what_nobody_can_judge_is_said_to_be_done():
    unknown = RESULT["execution"] | {"rms_error_m": None}
    text = "\n".join(summary(RESULT | {"success": None, "execution": unknown}))
    assert "DONE, NOT JUDGED" in text and "only a simulation's perception knows" in text
    assert "FAILED" not in text and "SUCCESS" not in text


@pytest.mark.parametrize(
    ("each", "whole"),
    [((True, True), True), ((True, None), None), ((None, False), False), ((True, False), False)],
)
def test_a_job_fails_with_one_task_and_is_judged_with_all(each: tuple, whole: bool | None):
    result = whole_result([RESULT | {"success": one} for one in each])
    assert result["success"] is whole and len(result["tasks"]) == 2


def test_of_several_tasks_each_is_told():
    tasks = [RESULT, RESULT | {"task": "other", "success": False}]
    text = "\n".join(summary({"success": False, "tasks": tasks, "link": RESULT["link"]}))
    assert "task planar: SUCCESS" in text and "task other: FAILED" in text


def test_where_the_plug_is_in_its_bore_or_before_it():
    def told(depth_m: float | None) -> str:
        execution = {
            "duration_s": 6.0, "depth_m": depth_m, "lateral_m": 0.004, "peak_force_n": 17.0, "holding_force_n": None,
        }  # fmt: skip
        return summary(RESULT | {"execution": execution})[-1]

    assert "the plug 85.1 mm deep" in told(0.0851)
    assert "the plug 118.0 mm before the mouth" in told(-0.118)
    assert "at an unknown depth: only a simulation knows the plug's true place; 17 N at most" in told(None)
