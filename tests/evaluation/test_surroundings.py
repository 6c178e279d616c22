"""A hundredth of the study of surroundings, with its own code: every command, each where something is unusual."""

from __future__ import annotations

import pytest

from farhand.evaluation.harness.started import spoken
from farhand.evaluation.live import surroundings

HUNDREDTH = [
    {"command": "link", "where": "unread error"},
    {"command": "learn", "where": "all three closed"},
    {"command": "import", "where": "a folder that was removed"},
    {"command": "link", "where": "a dumb terminal"},
    {"command": "local", "where": surroundings.NAMED},
    {"command": "up", "where": "Ctrl-C", "at_s": surroundings.MOMENTS_S[6]},
]


@pytest.mark.parametrize("case", HUNDREDTH, ids=lambda case: f"{case['command']} {case['where']}")
def test_a_command_works_or_says_in_one_line_what_would_help(case: surroundings.Case):
    assert case in surroundings.cases(None, seed=0)
    result = surroundings.trial(case)
    assert result["verdict"] in ("works", "refused", "interpreter"), result["why"]


def test_every_command_is_started_in_thirty_surroundings_and_interrupted_at_twenty_moments():
    cases = surroundings.cases(None, seed=0)
    for command in (*surroundings.SITES, *surroundings.FILES):
        places = {case["where"] for case in cases if case["command"] == command}
        moments = {case["at_s"] for case in cases if case["command"] == command and "at_s" in case}
        assert len(places) >= 30 and len(moments) == 20


def test_of_what_a_process_says_only_the_log_is_left_out():
    words = (
        "[11/29/26 23:09:10] \x1b[34mINFO    \x1b[0m link: the link is ready: 127.0.0.1 port 1 to   \r\n"
        "                             127.0.0.1 port 7447, geo                           \r\n"
        "                    WARNING  link: nobody answers   \r\n"
        "2026-11-29 23:33:52,549 INFO    local: the robot reports\n"
        "2026-11-29 23:33:52,549 ERROR   local: it broke\n"
        "farhand: a line\n\nTraceback\n"
    )
    assert spoken(words) == [
        "2026-11-29 23:33:52,549 ERROR   local: it broke",
        "farhand: a line",
        "Traceback",
    ]


def test_a_fault_is_told_with_its_words():
    found = {"command": "link", "where": "ordinary", "verdict": "fault", "why": "status 1: Traceback"}
    summary, text = surroundings.summarise([found])
    assert not summary["passed"]
    assert "- link, ordinary: status 1: Traceback" in text
