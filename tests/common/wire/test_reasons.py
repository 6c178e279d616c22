from __future__ import annotations

import ast
import string
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given

from farhand.common.wire.reason_words import PRESS_AGAIN, WORDS, sentence
from farhand.common.wire.reasons import MOST_TEXT, Code, Reason, Value, because, in_words
from tests.messages import reasons

ROOT = Path(__file__).parents[3]
SITES = ("common", "local_site", "remote_site")


def made() -> Iterator[tuple[str, set[str], set[str]]]:
    """Every call of `because` in the shipped code: where it is, the codes that it may have, the values that it gives."""
    for path in (path for site in SITES for path in sorted((ROOT / site).rglob("*.py"))):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "because":
                codes = {
                    part.attr
                    for part in ast.walk(node.args[0])
                    if isinstance(part, ast.Attribute) and part.attr.isupper()
                }
                values = {word.arg for word in node.keywords if word.arg}
                yield f"{path.relative_to(ROOT)}:{node.lineno}", codes, values


def named_in(code: Code) -> set[str]:
    """The values that a sentence needs."""
    return {name for _, name, _, _ in string.Formatter().parse(WORDS[code]) if name} - {"cause"}


def test_every_code_has_a_sentence():
    assert set(WORDS) == set(Code)
    assert set(Code) >= PRESS_AGAIN


def test_whoever_gives_a_reason_gives_the_values_that_its_sentence_names():
    for where, codes, values in made():
        for code in codes:
            assert named_in(Code[code]) <= values, f"{where}: {code}"


def test_every_code_is_given_by_somebody():
    text = "\n".join(
        path.read_text(encoding="utf-8")
        for site in SITES
        for path in (ROOT / site).rglob("*.py")
        if path.name not in ("reasons.py", "reason_words.py")
    )
    assert [code.name for code in Code if f"Code.{code.name}" not in text] == []


@given(reasons)
def test_whatever_reason_arrives_something_is_said(reason: Reason):
    assert sentence(reason) or not reason.code or reason.code == Code.OTHER


@pytest.mark.parametrize("code", [code for code in Code if named_in(code)])
def test_a_reason_of_another_version_that_lacks_its_values_is_shown_as_it_came(code: Code):
    assert sentence(Reason(code.value, (Value("new_s", 2.5),))) == f"{code} (new_s 2.5)"


def test_a_code_that_is_not_known_is_shown_with_its_values_and_its_cause():
    newer = Reason("valve closed", (Value("pressure_bar", 3.5), Value("valve", "V2")))
    assert sentence(newer) == "valve closed (pressure_bar 3.5, valve V2)"
    assert sentence(newer, because(Code.JAMMED)).endswith(": jammed too often")


def test_numbers_are_shown_in_the_units_of_people_and_names_as_they_are():
    assert sentence(because(Code.MOVED_SINCE, moved_m=0.0123, what="robot")).startswith(
        "the robot moved 12 mm"
    )
    assert "3 degrees" in sentence(because(Code.TURNED_SINCE, turned_rad=0.0524, what="robot"))
    assert (
        sentence(because(Code.OTHER_TASK, does=("a", "b"), task="c"))
        == "this robot does 'a' and 'b', not 'c'"
    )
    assert "only in DISARMED" in sentence(because(Code.WRONG_MODE, action="arm", mode="hold"))


def test_what_was_measured_is_the_first_number_and_a_number_is_always_finite_and_a_text_short():
    assert because(Code.FORCE, force_n=401.0, limit_n=400.0).measured == 401.0
    assert because(Code.JAMMED).measured is None
    assert because(Code.NOT_SEEN, unseen_s=float("inf")).measured == pytest.approx(1e30)
    assert because(Code.NOT_SEEN, unseen_s=float("nan")).measured == 0.0
    assert sentence(in_words("x" * 1000)) == "x" * MOST_TEXT


def test_what_was_only_counted_is_said_with_the_sentence():
    told = because(Code.LEASE_ENDED).with_value("n_more", 7)
    assert sentence(told).endswith("(and 7 more like it)") and told.measured is None
