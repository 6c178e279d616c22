"""Each fact that is wrong leads to its own trouble, alone; together they never lead to an error."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from farhand.common.process_status import DataFolder, LinkFacts, OperatorFacts, ProcessStatus, RobotFacts
from farhand.deploy.diagnosis import diagnose
from farhand.deploy.process_discovery import Entry, LastWords
from farhand.deploy.status import DEGRADED, HEALTHY, NOT_THERE, judge

DATA = DataFolder(path="/data", free_bytes=10**12)
ROBOT = RobotFacts(
    mode="hold", phase="", holder="operator", heard_s=0.3, tick_age_s=0.01, overruns=0, control_hz=100.0,
    model="", stopped_because="", stopped_by_fault=False, waiting=0,
)  # fmt: skip
LINK = LinkFacts(
    target="robot:7447", profile="geo", outage="none", outage_left_s=0.0, connections=1, queued_bytes=0, target_error=""
)  # fmt: skip
SITE = OperatorFacts(
    page="http://127.0.0.1:8080", robot_mode="hold", robot_phase="", robot_version="1.0", robot_tasks=("hot-stab",),
    robot_stopped_by_fault=False, holder="operator", in_control=True, only_watches=False, why_not_in_control="",
    link="ok", silent_s=0.1, age_s=0.4, round_trip_s=0.6, not_understood="", relay=LINK, relay_error="", waiting=0,
    tick_age_s=0.01,
)  # fmt: skip
FACTS = {"robot": ROBOT, "link": LINK, "operator": SITE}


def entry(role: Any, status: dict[str, Any] | None = None, **facts: Any) -> Entry:
    """A process that answers, with some of its status and facts changed."""
    whole = ProcessStatus(
        role=role, name=role, pid=1, uptime_s=1.0, version="1.0", tasks=("hot-stab",),
        data=None if role == "link" else DATA, facts=replace(FACTS[role], **facts),
    )  # fmt: skip
    return Entry(role=role, name=role, pid=1, status=replace(whole, **(status or {})))


def gone(role: str, fault: str, code: str = "failed") -> Entry:
    words = LastWords(pid=1, code=code, text="it said so", at_s=0.0)
    return Entry(role=role, name=role, pid=1, fault=fault, words=words if fault == "ended" else None)


def codes(*entries: Entry) -> list[str]:
    return [trouble.code for trouble in diagnose(entries)]


def with_others(changed: Entry) -> list[Entry]:
    return [changed if role == changed.role else entry(role) for role in FACTS]


def test_healthy_processes_have_no_trouble() -> None:
    everybody = [entry(role) for role in FACTS]
    assert diagnose(everybody) == []
    assert judge(everybody, []) == HEALTHY
    assert judge([], []) == judge([gone("robot", "dead")], []) == NOT_THERE


CASES = [
    ("robot-stopped", entry("robot", mode="stopped", stopped_by_fault=True, stopped_because="late")),
    ("stale", entry("robot", tick_age_s=2.0)),
    ("stale", entry("operator", tick_age_s=2.0)),
    ("stale", gone("robot", "silent")),
    ("robot-dead", gone("robot", "dead")),
    ("link-dead", gone("link", "dead")),
    ("operator-dead", gone("operator", "dead")),
    ("port-taken", gone("operator", "ended", "port-taken")),
    ("failed", gone("link", "ended")),
    ("version-differs", gone("link", "foreign")),
    ("version-differs", entry("robot", {"version": "2.0"})),
    ("version-differs", entry("operator", robot_version="2.0")),
    ("version-differs", entry("operator", not_understood="schema: version 1, got 2")),
    ("version-differs", entry("robot", not_understood="schema: version 1, got 2")),
    ("disk-full", entry("robot", {"data": replace(DATA, free_bytes=1000)})),
    ("disk-full", entry("operator", {"data": replace(DATA, full=True, write_error="no space")})),
    ("not-kept", entry("operator", {"data": replace(DATA, write_error="read-only")})),
    ("starting", Entry(role="robot", name="robot", pid=1, status=replace(entry("robot").status, facts=None))),  # type: ignore[type-var]
    ("no-lease", entry("operator", in_control=False, why_not_in_control="held by shore-2")),
    ("wrong-task", entry("operator", robot_tasks=("planar",))),
    ("robot-stopped", entry("operator", robot_stopped_by_fault=True)),
    ("link-cut", entry("link", outage="stall", outage_left_s=5.0)),
    ("link-cut", entry("operator", link="lost", silent_s=5.0)),
]


@pytest.mark.parametrize(("code", "changed"), CASES, ids=[f"{code} {each.role}" for code, each in CASES])
def test_each_fault_is_told_alone_and_with_a_remedy(code: str, changed: Entry) -> None:
    troubles = diagnose(with_others(changed))
    assert [trouble.code for trouble in troubles] == [code]
    assert troubles[0].text and troubles[0].remedy
    assert judge(with_others(changed), troubles) == DEGRADED


def test_what_follows_from_a_cause_is_not_told_beside_it() -> None:
    lost = {"link": "lost", "silent_s": 9.0, "in_control": False}
    cut = replace(LINK, outage="stall", outage_left_s=5.0)
    refused = replace(LINK, target_error="Connection refused")
    assert codes(entry("operator", **lost), gone("robot", "dead"), entry("link")) == ["robot-dead"]
    assert codes(entry("operator", **lost), gone("robot", "silent")) == ["stale"]
    assert codes(entry("operator", relay=cut, **lost), entry("robot"), entry("link", outage="stall")) == [
        "link-cut"
    ]
    assert codes(entry("operator", relay=None, relay_error="refused", **lost), gone("link", "dead")) == [
        "link-dead"
    ]
    assert codes(entry("operator", relay=refused, **lost), entry("link", target_error="refused")) == [
        "robot-dead"
    ]


def test_the_operators_site_alone_tells_apart_what_it_can() -> None:
    lost = {"link": "lost", "silent_s": 9.0}
    assert codes(entry("operator", relay=replace(LINK, outage="reset"), **lost)) == ["link-cut"]
    assert codes(entry("operator", relay=None, relay_error="refused", **lost)) == ["link-dead"]
    assert codes(entry("operator", relay=replace(LINK, target_error="refused"), **lost)) == ["robot-dead"]
    assert codes(entry("operator", relay=None, **lost)) == ["stale"]
    assert codes(entry("operator", link="never", silent_s=None)) == ["page-only"]
    assert codes(entry("operator", in_control=False, only_watches=True)) == []


@given(
    st.lists(st.sampled_from([changed for _, changed in CASES] + [entry(role) for role in FACTS]), max_size=6)
)
def test_any_number_of_faults_together_are_told_in_words(found: list[Entry]) -> None:
    troubles = diagnose(found)
    assert all(trouble.text and trouble.remedy for trouble in troubles)
    if any(each.fault for each in found):
        assert troubles
