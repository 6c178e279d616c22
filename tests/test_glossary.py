"""The glossary of docs/conventions.md names code that exists."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NAMED = re.findall(r"`([\w/]+\.py): (\w+)`", (ROOT / "docs" / "conventions.md").read_text(encoding="utf-8"))


def test_the_glossary_is_there():
    assert len(NAMED) > 40


@pytest.mark.parametrize(("file", "name"), NAMED, ids=lambda value: str(value).rpartition("/")[2])
def test_a_name_of_the_glossary_is_defined_in_its_file(file: str, name: str):
    defined = ast.parse((ROOT / file).read_text(encoding="utf-8")).body
    assert name in {getattr(node, "name", "") for node in defined}
