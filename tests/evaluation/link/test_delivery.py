"""Each part of the study of delivery, a few times, over real sockets; how fast it is depends on the machine."""

from __future__ import annotations

import pytest

from farhand.evaluation.link import delivery
from farhand.evaluation.link.outages_and_loss import WAY_S, fresh_after_s, job

MEASURED = {
    "what": "quic, 10 %", "transport": "quic", "loss": 10.0, "age_s": [0.31] * 20, "reports_hz": 22.0, "missed": 0.1,
    "commands_s": [0.62] * 20, "refused": 1, "stops_s": [0.7] * 20, "bytes_s": {"uplink": 100.0, "downlink": 9000.0},
    "scheduling": "niceness 0",
}  # fmt: skip


def test_over_a_lossy_link_reports_commands_and_stops_are_timed_and_losses_counted():
    found = delivery.measure("quic", 10.0, {"seed": 3, "commands": 4, "stops": 2})
    assert len(found["commands_s"]) == 4 and min(found["commands_s"]) > 2 * WAY_S
    assert len(found["stops_s"]) == 2 and min(found["stops_s"]) > 2 * WAY_S
    assert min(found["age_s"]) > WAY_S - 0.02
    assert found["missed"] > 0.01  # the link did lose datagrams


def test_fresh_data_after_an_outage_is_timed_from_its_end():
    [took_s] = fresh_after_s(2.0, 1)
    assert took_s > WAY_S - 0.02  # nothing that left before the end of the outage counts


def test_a_job_goes_on_while_the_link_changes_its_ports_in_the_middle():
    assert job("other ports in the middle", 5, "planar") == {"seed": 5, "success": True, "why": ""}


@pytest.mark.parametrize(
    ("changed", "passes"),
    [({}, True), ({"age_s": [0.34] * 20}, False), ({"commands_s": [0.66] * 20}, False), ({"stops_s": [1.1] * 20}, False)],
)  # fmt: skip
def test_what_is_measured_is_held_against_its_limits(changed: delivery.Case, passes: bool):
    summary, markdown = delivery.summarise([{**MEASURED, **changed}])
    assert summary["passed"] is passes
    assert ("| NO |" in markdown) is not passes


def test_one_late_outage_or_failed_job_fails_the_study():
    outage = {"what": "outage of 2 s", "outage_s": 2.0, "took_s": [0.4, 0.56], "scheduling": ""}
    failed = {
        "what": "job, 5 % lost",
        "jobs": [{"seed": 1, "success": False, "why": "no link"}],
        "scheduling": "",
    }
    for result in (outage, failed):
        summary, _ = delivery.summarise([result])
        assert not summary["passed"]
