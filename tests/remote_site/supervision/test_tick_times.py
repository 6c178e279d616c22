from __future__ import annotations

from typing import Any

import pytest

from farhand.remote_site.site import LINE_PERIOD_S, TickTimes


def test_a_line_a_minute_tells_the_quantiles_of_that_minute():
    lines = list[dict[str, Any]]()
    times = TickTimes(lambda **fields: lines.append(fields), control_hz=100.0)
    n = round(LINE_PERIOD_S * 100.0)
    for k in range(2 * n - 1):
        times.add(1e-3 * (k % n) / n, 2e-3, overruns=7)
    (line,) = lines
    assert (line["kind"], line["n"], line["overruns"]) == ("ticks", n, 7)
    assert line["cpu_p50_ms"] == pytest.approx(0.5, abs=1e-2)
    assert line["cpu_p99_ms"] == pytest.approx(0.99, abs=1e-2)
    assert line["late_max_ms"] == line["late_p50_ms"] == 2.0


def test_what_is_left_is_told_at_the_end_and_nothing_twice():
    lines = list[dict[str, Any]]()
    times = TickTimes(lambda **fields: lines.append(fields), control_hz=50.0)
    times.add(1e-3, 0.0, 0)
    times.tell(0)
    times.tell(0)
    assert [line["n"] for line in lines] == [1]
