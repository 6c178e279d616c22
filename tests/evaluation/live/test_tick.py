"""A hundredth of the study of control periods; the whole of it is `farhand evaluate tick`."""

from __future__ import annotations

import json
from pathlib import Path

from farhand.evaluation.live import tick


def test_the_live_arm_s_control_periods_are_counted_beside_page_and_job():
    (case,) = tick.cases(None, 3)
    assert case == {"task": "hot-stab", "seed": 3, "duration_s": 600.0}
    result = tick.trial({**case, "duration_s": 6.0})
    summary, markdown = tick.summarise([result])
    # The robot ran before the first job began, too.
    assert summary["periods"] + summary["left_out"] > 200
    assert 0.0 < summary["cpu_p50_ms"] <= summary["cpu_p99_ms"] <= summary["cpu_max_ms"]
    assert "| worst |" in markdown


def test_only_the_lines_about_periods_are_read_and_the_worst_minute_decides(tmp_path: Path):
    times = dict.fromkeys(tick._TIMES, 1.0)
    minutes = [
        {"kind": "ticks", "n": 5990, "overruns": 10, **times},
        {"kind": "ticks", "n": 6000, "overruns": 12, **times, "cpu_p99_ms": 5.1},
    ]
    events = tmp_path / "events.jsonl"
    lines = [minutes[0], {"kind": "mode", "text": "HOLD"}, minutes[1]]
    events.write_text("".join(json.dumps(line) + "\n" for line in lines))
    assert tick.tick_lines(events) == minutes
    result = {"minutes": minutes, "succeeded": [True], "loads": [1.0, 2.0], "scheduling": "niceness 0"}
    summary, markdown = tick.summarise([result])
    assert (summary["periods"], summary["left_out"], summary["passed"]) == (11990, 12, False)
    assert summary["cpu_p99_ms"] == 5.1 and summary["late_p99_ms"] == 1.0
    assert "every minute: NO" in markdown
    assert tick.summarise([{**result, "minutes": minutes[:1]}])[0]["passed"]
