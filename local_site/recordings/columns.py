"""Roles of columns: times, positions and orientations of bodies.

The user's ``--columns`` come first, then the headers; an ambiguous column is refused, never guessed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.local_site.recordings.headers import ColumnLabel, label
from farhand.local_site.recordings.options import ImportOptions

Array = NDArray[np.float64]

BODY_ROLES = (
    "x",
    "y",
    "z",
    "qw",
    "qx",
    "qy",
    "qz",
    "q0",
    "q1",
    "q2",
    "q3",
    "rx",
    "ry",
    "rz",
    "roll",
    "pitch",
    "yaw",
)


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of numbers as in the file.

    Args:
        name: Name of the body if the headers name none: a topic, a TF frame.
        headers: One per column. Length C.
        numbers: Numbers; NaN for an empty cell. Shape (T, C).
        rows: Number of each row in the file. Shape (T,).
        row: Word for a row in this kind of file: line, message, frame.
        parent: Name of the frame in which the poses are given; empty: the world.
        units: Units by kind (length, angle, time) for headers without one.
        order: Order of quaternions with numbered columns, if the format has one.
        texts: Row and text of the cells that are no numbers, by column.
        told: Interpretation of the file, for the preview.
    """

    name: str
    headers: tuple[str, ...]
    numbers: Array
    rows: NDArray[np.int64]
    row: str = "row"
    parent: str = ""
    units: dict[str, str] = field(default_factory=dict)
    order: str = ""
    texts: dict[int, list[tuple[int, str]]] = field(default_factory=dict)
    told: str = ""

    def part(self, keep: NDArray[np.bool_]) -> Table:
        """Return the table with the kept rows only."""
        rows = self.rows[keep]
        kept = set(rows.tolist())
        texts = {
            n: left for n, bad in self.texts.items() if (left := [cell for cell in bad if cell[0] in kept])
        }
        return replace(self, numbers=self.numbers[keep], rows=rows, texts=texts)


class Roles(NamedTuple):
    """Columns of a table by their role."""

    time: dict[str, int]
    """Columns of times, frame numbers and episodes, by role."""
    bodies: dict[str, dict[str, int]]
    """Columns of each body that has a position, by role."""
    ignored: list[str]
    """Headers of unused columns."""


def assign(table: Table, options: ImportOptions) -> Roles:
    """Find the columns of times and bodies.

    Raises:
        InvalidDemonstration: When two columns would fit one role, or a column that was named is missing.
    """
    chosen = {
        body: {role: None if column == "-" else _column(table, column) for role, column in columns.items()}
        for body, columns in options.chosen_columns().items()
    }
    taken = {index for columns in chosen.values() for index in columns.values()}
    time: dict[str, int] = {}
    bodies: dict[str, dict[str, int]] = {}
    for index, header in enumerate(table.headers):
        found = label(header)
        if found is None or index in taken:
            continue
        timely = found.role not in BODY_ROLES and not found.role.startswith("p")
        if found.role in chosen.get("" if timely else found.body, {}):
            continue  # the user has said which column it is
        roles = time if timely else bodies.setdefault(found.body, {})
        roles[found.role] = _the_one(table, found, roles.get(found.role), index)
    for body, columns in chosen.items():
        for role, index in columns.items():
            if index is not None:
                roles = bodies.setdefault(body, {}) if role in BODY_ROLES else time
                roles[role] = index
    whole = {
        name or table.name: _three_numbers(columns) for name, columns in bodies.items() if _is_placed(columns)
    }
    used = set(time.values()).union(*(columns.values() for columns in whole.values()))
    return Roles(time, whole, [header for n, header in enumerate(table.headers) if n not in used])


def _the_one(table: Table, found: ColumnLabel, before: int | None, index: int) -> int:
    if before is None or found.role == "frame":
        return index
    both = table.headers[before], table.headers[index]
    if found.role == "t":  # a message's own stamp is better than the time at which it was written down
        stamped = ["stamp" in header.lower().replace("timestamp", "") for header in both]
        if stamped[0] != stamped[1]:
            return (before, index)[stamped[1]]
    of = f" of {found.body!r}" if found.body else ""
    expected = f"one column for {found.role}{of}, got {both[0]!r} and {both[1]!r}: choose with --columns {found.role}=..."
    raise InvalidDemonstration("recording", "header", expected)


def _column(table: Table, name: str) -> int:
    """Return the index of the column that a user named, by its header or its number from one."""
    same = [index for index, header in enumerate(table.headers) if header == name]
    if len(same) == 1:
        return same[0]
    if not same and name.isdecimal() and 1 <= int(name) <= len(table.headers):
        return int(name) - 1
    known = ", ".join(repr(header) for header in table.headers[:40])
    expected = f"one column of that name or number among the {len(table.headers)}: {known}"
    raise InvalidDemonstration("recording", f"--columns {name}", expected)


def _is_placed(columns: dict[str, int]) -> bool:
    return (
        "x" in columns
        and "y" in columns
        and not any(role.startswith("p") and role[1:].isdigit() for role in columns)
    )


def _three_numbers(columns: dict[str, int]) -> dict[str, int]:
    """Take a rotation of x, y, z without w for what it is: no quaternion."""
    if "qw" not in columns and {"qx", "qy", "qz"} <= columns.keys():
        return {
            role.replace("q", "r") if role in ("qx", "qy", "qz") else role: n for role, n in columns.items()
        }
    return columns
