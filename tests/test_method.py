"""docs/method.md: every point says which test holds the software to it, and the test exists."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "method.md").read_text(encoding="utf-8")
POINTS = re.findall(r"^\*\*(.+?)\.\*\*(.*?)(?=^\*\*|^#|\Z)", PAGE, re.DOTALL | re.MULTILINE)
TESTS = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))


@pytest.mark.parametrize(("point", "text"), POINTS, ids=[point for point, _ in POINTS])
def test_every_point_names_tests_that_exist(point: str, text: str):
    named = re.findall(r"`(test_\w+)`", text)
    assert named, f"no test for: {point}"
    assert [name for name in named if f"def {name}(" not in TESTS] == []


def test_every_question_that_the_paper_leaves_open_is_a_point():
    named = {point.lower() for point, _ in POINTS}
    for question in (
        "terminal components",
        "hysteresis",
        "durations in seconds",
        "pauses and order",
        "paths that cross themselves or return",
        "several task frames",
        "poses",
        "refining an old model",
        "neither stalling nor running ahead",
        "push, hold, jump, sway",
        "the frame's velocity",
        "which branch, and why",
        "starting beside or behind the goal",
    ):
        assert question in named
