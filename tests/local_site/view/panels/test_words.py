"""The page's words are in one folder, and count in the singular where that is right."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from msgspec import structs

from farhand.common.mode_table import ControlMode
from farhand.local_site import view
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.report_age import LinkHealth
from farhand.local_site.view.panels.words.lists import too_slow_words
from farhand.local_site.view.panels.words.status import stop_does_words
from tests.local_site.view.panels.test_truth import OK, ROBOT_IN

_FOLDER = Path(view.__file__).parent
_SHOWN = [
    file
    for part in ("panels", "scene")
    for file in (_FOLDER / part).rglob("*.py")
    if "words" not in file.parts
]
_SENTENCE = re.compile(r"[A-Za-z]{3,} [a-z]{2,}")
_MARKUP = re.compile(r"\bfh-[\w-]*|<[^>]*>|<[^>]*$|^[^<]*>|[\w-]+=\"[^\"]*(\"|$)|\{[^}]*\}")


def texts(tree: ast.AST) -> Iterator[str]:
    """Texts of a file that a person could see: no documentation, nothing for the log, no markup."""
    hidden = {
        id(part)
        for node in ast.walk(tree)
        if isinstance(node, ast.Raise | ast.Assert | ast.Expr) and not _is_a_call_that_draws(node)
        for part in ast.walk(node)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in hidden:
            yield _MARKUP.sub(" ", node.value)


def _is_a_call_that_draws(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Call)
        and "_log" not in ast.dump(node.value.func)
    )


@pytest.mark.parametrize("file", _SHOWN, ids=lambda file: file.stem)
def test_no_panel_and_no_scene_has_sentences_of_its_own(file: Path) -> None:
    styled = ("class", "stroke", "viewBox")
    found = [
        text for text in texts(ast.parse(file.read_text("utf-8")))
        if _SENTENCE.search(text) and not any(word in text for word in styled)
    ]  # fmt: skip
    assert found == []


@pytest.mark.parametrize("file", _SHOWN, ids=lambda file: file.stem)
def test_no_control_is_named_where_it_is_made(file: Path) -> None:
    named = [
        ast.unparse(call)
        for call in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute)
        if re.fullmatch("add_(button|slider|checkbox|dropdown|text|folder|upload_button)", call.func.attr)
        if any(isinstance(each, ast.Constant | ast.JoinedStr) for each in call.args[:1])
    ]
    assert named == []


@pytest.mark.parametrize(
    ("mode", "health", "words"),
    [
        (ControlMode.HOLD, LinkHealth.OK, "stands, and is locked"),
        (ControlMode.AUTONOMOUS, LinkHealth.OK, "brakes, holds, locked"),
        (ControlMode.DIRECT, LinkHealth.OK, "brakes, holds, locked"),
        (ControlMode.AUTONOMOUS, LinkHealth.LOST, "sent until it arrives"),
        (ControlMode.STOPPED, LinkHealth.OK, "stopped already"),
    ],
)
def test_stop_says_what_it_would_do(
    nothing_yet: ConsoleState, mode: ControlMode, health: LinkHealth, words: str
) -> None:
    link = replace(OK, health=health)
    state = replace(nothing_yet, robot=structs.replace(ROBOT_IN, mode=mode), link=link)
    assert stop_does_words(state) == words


@pytest.mark.parametrize(
    ("rate_bps", "told_bps", "warns"),
    [(9600.0, 0.0, True), (9600.0, 1e7, True), (9600.0, 9600.0, False), (1e7, 0.0, False), (0.0, 0.0, False)],
)
def test_a1_a_link_that_carries_less_than_the_sites_were_told_is_said_to_be_late(
    rate_bps: float, told_bps: float, warns: bool
) -> None:
    words = too_slow_words(rate_bps, told_bps)
    assert bool(words) is warns and ("--link-rate-bps=9600" in words) is warns
