from __future__ import annotations

import pytest

from farhand.evaluation.harness.real_sites import RealSites
from farhand.evaluation.link import link_delay


def test_the_medians_are_held_against_their_limits():
    def result(transport_ms: float, command_ms: float) -> list[link_delay.Case]:
        delay = {
            "delay_s": 0.3, "demo": {"success": True, "rms_error_m": 0.002}, "transport_ms": [transport_ms] * 3, "commands_ms": [command_ms] * 3, "load": 1.5,
            "relay_lateness_ms": {way: {"p50": 0.2, "p99": 1.0, "max": 2.0} for way in ("uplink", "downlink")},
        }  # fmt: skip
        return [{"delays": [delay], "scheduling": "niceness 0"}]

    summary, markdown = link_delay.summarise(result(1.9, 22.9))
    assert summary["passed"]
    assert (
        "All hold" in markdown
        and "| 0.3 | 1.90 / 1.90 (3) | 0.20 | 22.9 / 22.9 (3) | done | 1.5 |" in markdown
    )
    failed = result(1.9, 22.9)
    failed[0]["delays"][0]["demo"]["success"] = False
    assert not link_delay.summarise(failed)[0]["passed"]
    assert not link_delay.summarise(result(2.1, 22.9))[0]["passed"]
    assert not link_delay.summarise(result(1.9, 23.1))[0]["passed"]


@pytest.mark.parametrize(
    ("line", "niceness"), [("/autogroup-12 nice 0\n", 0), ("/autogroup-7 nice -8\n", -8), ("", 0)]
)
def test_the_niceness_of_a_session_s_group_is_read_and_nothing_where_there_is_no_group(
    line: str, niceness: int
):
    assert link_delay.group_niceness(line) == niceness


def test_a_command_of_the_real_console_takes_both_delays_and_is_timed(monkeypatch):
    monkeypatch.setattr(
        RealSites, "run_demo", lambda self: {"success": True, "execution": {"rms_error_m": 0.0}}
    )
    monkeypatch.setattr(link_delay, "DELAYS_S", (0.3,))
    [measured] = link_delay.trial({"commands": 4, "questions": 30})["delays"]
    assert len(measured["commands_ms"]) == 4 and len(measured["transport_ms"]) == 30
    # Nothing can be faster than the link; how much slower it is depends on the machine.
    assert min(measured["commands_ms"]) > -1.0 and min(measured["transport_ms"]) > -1.0
    assert measured["relay_lateness_ms"]["uplink"]["p50"] >= 0.0
