"""A hundredth of the soak; the whole of it is `farhand evaluate arm-soak`."""

from __future__ import annotations

from pathlib import Path

from farhand.evaluation.arm import arm_soak
from farhand.evaluation.arm.robustness import SCENARIOS
from farhand.evaluation.study import reporting_seeds


def test_insertions_in_a_row_need_no_more_memory_and_nothing_is_warned_of(tmp_path: Path):
    (case,) = arm_soak.cases(10, 3)
    assert case["seeds"] == list(reporting_seeds(3, 10))
    result = arm_soak.trial(case)
    assert {row["scenario"] for row in result["rows"]} == set(SCENARIOS)
    summary, markdown = arm_soak.summarise([result])
    assert summary["trials"] == 10 and summary["warnings"] == 0
    assert summary["grown_mib"] < 20.0
    assert "| 10 |" in markdown
    (figure,) = arm_soak.draw([result], tmp_path)
    assert (tmp_path / figure).read_bytes().startswith(b"\x89PNG")


def test_a_warning_is_counted():
    row = {
        "success": False,
        "cause": "MuJoCo warned of mjWARN_BADQACC",
        "resident_mib": 100.0,
        "tick_ms": 1.0,
    }
    summary, _ = arm_soak.summarise([{"rows": [{**row, "success": True, "cause": ""}, row]}])
    assert summary["warnings"] == 1 and summary["grown_mib"] == 0.0
