"""docs/notation.md says what the code says."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from farhand.common.model.tphsmm import ARRAY_FIELDS

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "notation.md").read_text(encoding="utf-8")


class Row(NamedTuple):
    symbol: str
    name: str
    file: str
    unit: str
    shape: str


def rows() -> list[Row]:
    cells = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in
             (line.replace("| |", "|  |") for line in PAGE.splitlines() if line.startswith("|"))]  # fmt: skip
    return [Row(*row) for row in cells if "`" in "".join(row)]


@cache
def identifiers(file: str) -> frozenset[str]:
    """Every name that a file of Python defines, takes or uses."""
    found: set[str] = set()
    for node in ast.walk(ast.parse((ROOT / file).read_text(encoding="utf-8"))):
        for field in ("id", "name", "arg", "attr"):
            if isinstance(name := getattr(node, field, None), str):
                found.add(name)
    return frozenset(found)


@pytest.mark.parametrize("row", rows(), ids=lambda row: f"{row.name} in {row.file}")
def test_every_name_is_in_its_file(row):
    names = re.findall(r"`(\w+)`", row.name)
    assert names
    assert set(names) <= identifiers(row.file)


def test_every_array_of_the_model_has_a_row_with_its_shape():
    listed = {row.name.strip("`"): row.shape for row in rows() if row.file == "common/model/tphsmm.py"}
    for name, (axes, _) in ARRAY_FIELDS.items():
        assert listed[name] == ("(K,)" if axes == "K" else f"({', '.join(axes)})"), name


def test_no_name_has_two_rows():
    written = [(row.name, row.file) for row in rows()]
    assert len(set(written)) == len(written) >= 40


def test_every_file_that_the_page_names_is_there():
    for file in re.findall(r"[\w/]+\.py", PAGE):
        assert (ROOT / file).is_file(), file
