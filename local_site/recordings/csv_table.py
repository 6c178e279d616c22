"""Reader of text files with columns: CSV of spreadsheets, motion capture and ROS, and trajectories of SLAM tools.

Delimiter, decimal comma, encoding, headers of several lines and their units are recognised; every fault names
its line as an editor counts it.
"""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections import Counter
from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.local_site.recordings.columns import Table
from farhand.local_site.recordings.headers import UNITS, unit_kind
from farhand.local_site.teaching.plain_arrays import MAX_NUMBERS

DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "bar": "|", "space": " "}
_SAMPLE = 60
_BLANK = {"", "nan", "na", "n/a", "null", "none", "-", "--"}
_DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")


class _Line(NamedTuple):
    number: int
    cells: list[str]


def read_text(content: bytes, delimiter: str = "auto") -> Table:
    """Return the columns of a text file.

    Args:
        content: The bytes of the file.
        delimiter: ``auto``, or a key of `DELIMITERS`.

    Raises:
        InvalidDemonstration: Naming the line at fault.
    """
    text, encoding = _decoded(content)
    chosen = DELIMITERS.get(delimiter) or _delimiter(text)
    lines = _ended([line for line in _lines(text, chosen) if any(line.cells)])
    comma = chosen != "," and any(
        _DECIMAL_COMMA.fullmatch(cell) for line in lines[-_SAMPLE:] for cell in line.cells
    )
    width = Counter(len(line.cells) for line in lines[-_SAMPLE:]).most_common(1)[0][0] if lines else 0
    begin = next(
        (n for n, line in enumerate(lines) if len(line.cells) >= width and _is_data(line, comma)), None
    )
    if begin is None:
        raise _invalid("", "lines of numbers in columns: is this another kind of file? --kind says which")
    headers, units, told = _headers(lines[:begin], width)
    data = [line for line in lines[begin:] if not line.cells[0].startswith("#")]
    for line in data:
        if len(line.cells) != width:
            expected = f"{width} cells as in the other lines, got {len(line.cells)}: mend or delete it"
            raise _invalid(f"line {line.number}", expected)
    if len(data) * width > MAX_NUMBERS:
        raise _invalid(
            "",
            f"at most {MAX_NUMBERS} numbers, got {len(data) * width}: cut the recording into several files",
        )
    rows = np.array([line.number for line in data])
    numbers, texts = _numbers([line.cells for line in data], rows, comma)
    name = next(key for key, value in DELIMITERS.items() if value == chosen)
    comma_told = ", decimal comma" if comma else ""
    return Table(
        "", headers, numbers, rows, "line", units=units, texts=texts,
        told=f"{encoding}, columns separated by {name}{comma_told}, {told}, data from line {data[0].number}",
    )  # fmt: skip


def _decoded(content: bytes) -> tuple[str, str]:
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16"), "UTF-16"
    if b"\0" in content[:4096]:
        raise _invalid("", "text, got a binary file: --kind says which kind it is")
    try:
        return content.decode("utf-8-sig"), "UTF-8"
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace"), "Windows-1252"


def _lines(text: str, delimiter: str) -> list[_Line]:
    stream = io.StringIO(text, newline=None)  # CRLF, CR and LF end a line
    if delimiter == " ":
        return [_Line(number, line.split()) for number, line in enumerate(stream, start=1)]
    reader = csv.reader(stream, delimiter=delimiter, skipinitialspace=True)
    return [_Line(reader.line_num, [cell.strip() for cell in cells]) for cells in reader]


def _ended(lines: list[_Line]) -> list[_Line]:
    """Return the lines without the blank column that a delimiter at the end of every line begins."""
    width = Counter(len(line.cells) for line in lines[-_SAMPLE:]).most_common(1)[0][0] if lines else 0
    if width < 3 or any(line.cells[-1] for line in lines if len(line.cells) == width):
        return lines
    return [
        _Line(line.number, line.cells[: width - 1]) if len(line.cells) == width else line for line in lines
    ]


def _delimiter(text: str) -> str:
    """Return the delimiter that makes most numbers of the file's last lines."""

    def numbers(delimiter: str) -> int:
        lines = _lines("\n".join(tail), delimiter)
        width = Counter(len(line.cells) for line in lines).most_common(1)[0][0] if lines else 0
        cells = [cell for line in lines if len(line.cells) == width >= 2 for cell in line.cells]
        return sum(_is_number(cell, delimiter != ",") for cell in cells)

    tail = [line for line in text.splitlines() if line.strip()][-_SAMPLE:]
    return max(DELIMITERS.values(), key=numbers)


def _is_number(cell: str, comma: bool) -> bool:
    if comma and _DECIMAL_COMMA.fullmatch(cell):
        return True
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _is_data(line: _Line, comma: bool) -> bool:
    filled = [cell for cell in line.cells if cell]
    count = sum(_is_number(cell, comma) or _moment(cell) is not None for cell in filled)
    most = count == len(filled) or (count >= 2 and 2 * count >= len(filled))
    return count >= 1 and most and not line.cells[0].startswith("#")


def _headers(above: list[_Line], width: int) -> tuple[tuple[str, ...], dict[str, str], str]:
    """Return the names of the columns, the units that hold for all, and what was made of the lines above the data."""
    units: dict[str, str] = {}
    named: list[_Line] = []
    for line in above:
        cells = [cell.lower() for cell in line.cells]
        for key, value in itertools.pairwise(cells):
            for kind in ("length", "angle", "time"):
                if key in (f"{kind} units", f"{kind} unit") and value in UNITS[kind]:
                    units[kind] = UNITS[kind][value][1]
        cells = line.cells
        if cells[0].startswith("#"):  # a comment may be the header
            cells = cells[1:] if len(cells) == width + 1 else [cells[0][1:].strip(), *cells[1:]]
        if len(cells) == width and not any(key.endswith("units") for key in map(str.lower, cells)):
            named.append(_Line(line.number, cells))
    named = [
        line for line in named if "id" not in [cell.lower() for cell in line.cells[:2]]
    ]  # of motion capture: noise
    if not named:
        return tuple(f"column {n + 1}" for n in range(width)), units, "no header"
    *over, last = named
    unit_row = [""] * width
    if over and all(unit_kind(cell.lower()) for cell in last.cells if cell):
        unit_row, last = [f" [{cell}]" if cell else "" for cell in last.cells], over.pop()
    names = [
        " ".join([*(_filled(line.cells, n) for line in over if n >= 2), cell]).strip() + unit_row[n]
        for n, cell in enumerate(last.cells)
    ]
    first, final = named[0].number, named[-1].number
    lines = f"header in line {first}" if first == final else f"header in lines {first} to {final}"
    return tuple(name or f"column {n + 1}" for n, name in enumerate(names)), units, lines


def _filled(cells: list[str], column: int) -> str:
    """Return a cell of a header's upper line; it holds for the blank ones to its right."""
    return next((cell for cell in reversed(cells[2 : column + 1]) if cell), "")


def _numbers(
    cells: list[list[str]], rows: NDArray[np.int64], comma: bool
) -> tuple[NDArray[np.float64], dict[int, list[tuple[int, str]]]]:
    """Return the numbers of all columns, and the cells that are none, by column."""
    texts: dict[int, list[tuple[int, str]]] = {}
    columns = list[NDArray[np.float64]]()
    for index, column in enumerate(zip(*cells, strict=True)):
        try:
            columns.append(np.array(column, dtype=float))
        except ValueError:
            values = [_number(cell, comma) for cell in column]
            bad = [(int(rows[n]), column[n]) for n, value in enumerate(values) if value is None]
            if bad:
                texts[index] = bad
            columns.append(np.array([np.nan if value is None else value for value in values]))
    return np.stack(columns, axis=1), texts


def _number(cell: str, comma: bool) -> float | None:
    """Return the number in a cell, seconds of a date with a time, NaN for a blank, None for another text."""
    if cell.lower() in _BLANK:
        return np.nan
    try:
        return float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        return _moment(cell)


def _moment(cell: str) -> float | None:
    if "-" not in cell or ":" not in cell:
        return None
    try:
        moment = datetime.fromisoformat(cell)
    except ValueError:
        return None
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def _invalid(field: str, expected: str) -> InvalidDemonstration:
    return InvalidDemonstration("recording", field, expected)
