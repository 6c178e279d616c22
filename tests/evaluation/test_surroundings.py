"""A hundredth of the study of surroundings, with its own code: every command, each where something is unusual."""

from __future__ import annotations

import pytest

from farhand.evaluation.live import surroundings

HUNDREDTH = [
    {"command": "link", "where": "unread error"},
    {"command": "learn", "where": "no HOME"},
    {"command": "import", "where": "a folder that was removed"},
    {"command": "remote", "where": "all three closed"},
    {"command": "local", "where": "foreign packages, PYTHONPATH"},
    {"command": "up", "where": "Ctrl-C", "at_s": surroundings.MOMENTS_S[6]},
]


@pytest.mark.parametrize("case", HUNDREDTH, ids=lambda case: f"{case['command']} {case['where']}")
def test_a_command_works_or_says_in_one_line_what_would_help(case: surroundings.Case):
    assert case in surroundings.cases(None, seed=0)
    result = surroundings.trial(case)
    assert result["verdict"] in ("works", "refused", "interpreter"), result["why"]


def test_a_fault_is_told_with_its_words():
    found = {"command": "link", "where": "ordinary", "verdict": "fault", "why": "status 1: Traceback"}
    summary, text = surroundings.summarise([found])
    assert not summary["passed"]
    assert "- link, ordinary: status 1: Traceback" in text
