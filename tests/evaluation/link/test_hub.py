"""About one per cent of the study of the hub; the whole of it is `farhand evaluate hub`."""

from __future__ import annotations

from typing import Any

import pytest

from farhand.evaluation.harness.routing_ends import RobotEnd, SiteEnd
from farhand.evaluation.link import hub


def result(run: str, **measured: Any) -> dict[str, Any]:
    """What a run within its limits finds, but for the values given."""
    found: dict[str, dict[str, Any]] = {
        "commands": {
            "took_s": [0.012] * 20,
            "directly_s": [0.011] * 20,
            "unanswered": 0,
            "core": 0.08,
            "each_hears_its_own": True,
        },
        "routing": {"arrived": 10_000, "wrong": 0},
        "watchers": {"alone_bytes_s": 10_000.0, "watched_bytes_s": 10_400.0},
        "restart": {"direct_s": [0.6, 0.7], "back_s": [0.8, 1.2], "went_on": True},
    }
    return {"run": run, "transport": "quic", "load": 0.5, **found[run], **measured}


def test_a_hundredth_of_the_messages_reaches_the_ends_that_they_name():
    case = next(case for case in hub.cases(100, 0) if case["run"] == "routing" and case["transport"] == "tcp")
    found = hub.trial(case)
    assert found["arrived"] >= 100 and found["wrong"] == 0


@pytest.mark.parametrize(
    ("run", "broken"),
    [
        ("commands", {"took_s": [0.021] * 20}),
        ("commands", {"core": 0.16}),
        ("commands", {"unanswered": 1}),
        ("commands", {"each_hears_its_own": False}),
        ("routing", {"wrong": 1}),
        ("watchers", {"watched_bytes_s": 10_600.0}),
        ("restart", {"direct_s": [0.6, 0.9]}),
        ("restart", {"back_s": [0.6, 2.1]}),
        ("restart", {"went_on": False}),
    ],
)
def test_each_broken_limit_fails_the_study(run: str, broken: dict[str, Any]):
    good = [result(kind) for kind in ("commands", "routing", "watchers", "restart")]
    summary, markdown = hub.summarise(good)
    assert summary["passed"] and markdown.startswith("# ")
    assert not hub.summarise([*good, result(run, **broken)])[0]["passed"]


def test_every_run_can_be_asked_for_alone():
    cases = hub.cases(None, 0)
    assert {(case["run"], case["transport"]) for case in cases} == {
        (run, transport)
        for run in ("commands", "routing", "watchers", "restart")
        for transport in ("quic", "tcp")
    }


class Silent:
    """Link that sends nothing."""

    def subscribe(self, *_: object) -> None: ...

    def serve(self, *_: object) -> None: ...


def test_an_end_counts_what_names_another_robot_or_another_site():
    robot, site = RobotEnd(Silent(), "rov1"), SiteEnd(Silent(), "rov1", "shore-1")  # type: ignore[arg-type]
    for end in (robot, site):
        for data in (b"rov1 shore-1", b"rov2 shore-1"):
            end._count(data)
        assert (end.arrived, end.wrong) == (2, 1)
    site._count(b"rov1 shore-2")
    robot._count(b"rov1 shore-2")
    assert (site.wrong, robot.wrong) == (2, 1)
