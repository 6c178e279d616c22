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
UNITS = {"s": 1.0, "ms": 1e-3, "m/s": 1.0, "mm/s": 1e-3, "m/s^2": 1.0, "mm": 1e-3, "m": 1.0, "N": 1.0, "%": 1e-2, "B": 1.0,
         "degrees": math.pi / 180.0, "": 1.0}  # fmt: skip
# Files of which every limit must be on the page, and the names in them that are none.
COMPLETE = {
    "remote_site/supervision/guards.py": set(),
    "remote_site/motion/coupling.py": set(),
    "remote_site/supervision/freshness.py": set(),
    "remote_site/supervision/operator_session.py": set(),
    "remote_site/supervision/operator_silence.py": set(),
    "remote_site/motion/manoeuvre.py": {"_REACHED_M", "_STANDING_M_S", "_PATIENCE_S"},
    "remote_site/motion/plans.py": {"_KEPT", "_REPLAN_S", "_REPLAN_FRAME_M"},
    "remote_site/motion/model_trial.py": {
        "_MOST_GAIN",
        "_TRIED_STEPS",
        "_TRIED_STARTS",
        "_MOST_WAITING",
        "_LIMITS",
        "_WAY_LIMITS",
    },
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
    for line in PAGE.partition("## Kinds of fault")[0].splitlines():
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
    assert len(rows()) == len(lines) - 2 * 5 >= 40


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


# Sentences of the page that were untrue once, each with a test that would fail if they were again.
HELD = {
    "An execution goes on without the link": "tests/remote_site/supervision/test_supervisor_guards.py",
    "Each press is a new stop":
        "tests/local_site/exchange/test_stop_sender.py::test_each_press_is_a_new_stop_and_the_operator_has_waited_since_the_first",
    "a robot that was reset meanwhile":
        "tests/remote_site/supervision/test_stop.py::test_a_stop_that_is_known_stops_a_robot_that_has_left_stopped",
    "it is on the wire while the console":
        "tests/evaluation/live/test_stop_lane.py::test_stop_overtakes_a_console_that_learns_writes_and_waits_for_the_arm",
    "against the robot's later report":
        "tests/local_site/exchange/test_stop_sender.py::test_an_acknowledgement_of_the_past_does_not_hide_that_the_robot_moves_now",
    "a suspend is a restart":
        "tests/remote_site/test_site.py::test_a_suspended_robot_begins_again_disarmed_and_refuses_what_was_asked_before",
    "nor its simulated target":
        "tests/remote_site/test_site.py::test_the_age_of_what_was_sent_before_counts_the_suspend",
    "Whatever fails in a control period":
        "tests/remote_site/supervision/test_failsafe.py::test_an_error_anywhere_in_a_period_stops_the_robot_from_every_mode",
    "A model is tried before it is confirmed":
        "tests/remote_site/motion/test_model_trial.py::test_what_nobody_demonstrates_is_refused_with_its_field",
    "another one has the control within 4 s":
        "tests/local_site/console/test_hand_over.py::test_a_site_that_hears_nothing_has_lost_the_control_to_the_other_one_within_four_seconds",
    "at its start where its place is not known":
        "tests/remote_site/robots/test_plant_memory.py::test_a_place_that_could_not_be_kept_is_set_aside_and_told",
    "older events are gone": "tests/common/test_json_lines.py",
}  # fmt: skip


@pytest.mark.parametrize("sentence", HELD)
def test_what_was_untrue_once_is_held_by_a_test(sentence: str):
    file, _, test = HELD[sentence].partition("::")
    assert sentence in PAGE
    assert f"def {test}(" in (ROOT / file).read_text(encoding="utf-8") if test else (ROOT / file).exists()


def kinds_of_fault() -> list[tuple[str, str, str, list[Path]]]:
    """The rows of the table of kinds: number, file and name of the place, files of tests."""
    _, _, table = PAGE.partition("## Kinds of fault")
    found = []
    for line in table.partition("\n## ")[0].splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 4 and (place := re.fullmatch(r"`([^`]+)` `([^`]+)`", cells[2])):
            found.append(
                (cells[0], place[1], place[2], [ROOT / file for file in re.findall(r"`([^`]+)`", cells[3])])
            )
    return found


def test_every_kind_of_fault_that_was_reported_has_its_row():
    numbers = {number for row, *_ in kinds_of_fault() for number in row.split(", ")}
    assert numbers == {str(n) for n in range(1, 22)} | {f"R{n}" for n in range(1, 20)}


@pytest.mark.parametrize(
    ("number", "file", "name", "tests"), kinds_of_fault(), ids=lambda value: str(value)[:12]
)
def test_a_kind_of_fault_ends_at_a_place_that_exists_and_is_held_by_at_least_four_tests(
    number: str, file: str, name: str, tests: list[Path]
):
    code = (ROOT / file).read_text(encoding="utf-8")
    assert all(re.search(rf"\b{part}\b", code) for part in name.split(".")), f"{number}: {file} has no {name}"
    held = "".join(path.read_text(encoding="utf-8") for path in tests)
    assert len(re.findall(r"^def test_", held, re.MULTILINE)) >= 4
