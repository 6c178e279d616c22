"""docs/safety.md has every limit with the value that the code has."""

from __future__ import annotations

import importlib
import math
import re
from pathlib import Path
from typing import NamedTuple

import msgspec
import pytest

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "safety.md").read_text(encoding="utf-8")
# What a unit of the page is in those of the code.
UNITS = {"s": 1.0, "ms": 1e-3, "m/s": 1.0, "mm/s": 1e-3, "m/s^2": 1.0, "mm": 1e-3, "N": 1.0, "%": 1e-2, "B": 1.0,
         "degrees": math.pi / 180.0, "": 1.0}  # fmt: skip
# Files of which every limit must be on the page, and the names in them that are none.
COMPLETE = {
    "remote_site/supervision/guards.py": set(),
    "remote_site/motion/coupling.py": set(),
    "remote_site/supervision/freshness.py": set(),
    "remote_site/supervision/session.py": {"_DELAY_CHANGED"},
    "remote_site/motion/manoeuvre.py": {"_REACHED_M", "_STANDING_M_S", "_PATIENCE_S"},
    "remote_site/motion/plans.py": {"_KEPT", "_REPLAN_S", "_REPLAN_FRAME_M"},
}


class Row(NamedTuple):
    limit: str
    value: str
    file: str
    name: str

    @property
    def number(self) -> float:
        """The value in the units of the code."""
        number, _, unit = self.value.partition(" ")
        return float(number) * UNITS[unit]

    @property
    def in_code(self) -> float:
        found = importlib.import_module("farhand." + self.file.removesuffix(".py").replace("/", "."))
        for part in self.name.split("."):
            defaults = {}
            if isinstance(found, type) and issubclass(found, msgspec.Struct):
                defaults = {field.name: field.default for field in msgspec.structs.fields(found)}
            found = defaults[part] if part in defaults else getattr(found, part)
        assert isinstance(found, int | float)
        return found


def rows() -> list[Row]:
    found = []
    for line in PAGE.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" |")]
        if line.startswith("|") and (
            where := re.fullmatch(r"`([\w/]+\.py)` `([\w.]+)`", cells[2:3][0] if cells[2:] else "")
        ):
            found.append(Row(cells[0], cells[1], *where.groups()))
    return found


@pytest.mark.parametrize("row", rows(), ids=lambda row: f"{row.limit}: {row.name}")
def test_every_limit_has_the_value_of_the_code(row: Row):
    assert row.number == pytest.approx(row.in_code, rel=1e-12)


def test_every_row_of_a_limit_was_understood():
    tables = PAGE.split("## Limits")[1].split("## What happens")[0]
    lines = [line for line in tables.splitlines() if line.startswith("|")]
    assert len(rows()) == len(lines) - 2 * 4 >= 40


@pytest.mark.parametrize("file", COMPLETE)
def test_no_limit_of_the_guarding_files_is_left_out(file: str):
    module = importlib.import_module("farhand." + file.removesuffix(".py").replace("/", "."))
    source = (ROOT / file).read_text(encoding="utf-8")
    names = {name for name in vars(module) if re.fullmatch(r"_?[A-Z][A-Z_]+", name)}
    own = {name for name in names if re.search(rf"^(\w+, )*{name}\b.* = ", source, re.MULTILINE)}
    listed = {row.name for row in rows() if row.file == file}
    assert own - COMPLETE[file] == listed


def test_the_network_stop_is_called_what_it_is():
    assert "protective stop, not an emergency stop" in PAGE
    assert "## Not protected" in PAGE
