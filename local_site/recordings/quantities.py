"""Quantities in the columns of a table, in SI units: times, positions and orientations, and in words where they come from.

A unit is what the user says, else the header, else the file, else metres and seconds; angles are never assumed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.local_site.recordings.columns import Table
from farhand.local_site.recordings.headers import UNITS, label
from farhand.local_site.recordings.options import ImportOptions

Array = NDArray[np.float64]

_WORDS = {"m": "metres", "cm": "centimetres", "mm": "millimetres", "rad": "radians", "deg": "degrees",
          "s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}  # fmt: skip
_SOURCES = {"option": "option", "header": "from the header", "file": "from the file", "": "assumed"}


def scale(table: Table, index: int, kind: str, said: str) -> tuple[float, str, str]:
    """Return how many of a column's unit make one of SI, its short name, and who said so: option, header, file or nobody."""
    found = label(table.headers[index])
    for unit, source in (
        (said, "option"),
        (found.unit if found else "", "header"),
        (table.units.get(kind), "file"),
    ):
        if unit and unit in UNITS[kind]:
            return *UNITS[kind][unit], source
    return 1.0, {"length": "m", "angle": "rad", "time": "s"}[kind], ""


def times(table: Table, time: dict[str, int], options: ImportOptions) -> tuple[Array, str]:
    """Return the times of all rows [s], and in words where they come from.

    Raises:
        InvalidDemonstration: When no column has them and no rate is given.
    """
    if options.rate_hz is not None:
        ticks = (
            table.numbers[:, time["frame"]] if "frame" in time else np.arange(len(table.rows), dtype=float)
        )
        counted = (
            f"column {table.headers[time['frame']]!r}"
            if "frame" in time
            else f"the number of the {table.row}"
        )
        return ticks / options.rate_hz, f"{counted}, {options.rate_hz:g} Hz (option)"
    if "t" not in time:
        expected = f"a column of times, got {', '.join(map(repr, table.headers[:20]))}: name it with --columns t=..., or give --rate-hz"
        raise _invalid("header", expected)
    numbers, header = table.numbers[:, time["t"]], table.headers[time["t"]]
    per, unit, source = scale(table, time["t"], "time", options.time_unit)
    largest = np.nanmax(np.abs(numbers), initial=0.0)
    if not source and largest > 1e11:  # no such times since 1970 in seconds: the year 5138
        per, unit = (1e9, "ns") if largest > 1e17 else (1e6, "us") if largest > 1e14 else (1e3, "ms")
        source = "since 1970, by its size"
    told = f"column {header!r}, {_WORDS[unit]} ({_SOURCES.get(source, source)})"
    if "nanosec" in time:
        return numbers / per + table.numbers[:, time["nanosec"]] / 1e9, told + " and nanoseconds"
    return numbers / per, told


def positions(table: Table, columns: dict[str, int], options: ImportOptions) -> tuple[Array, str]:
    """Return the positions of a body in all rows [m], shape (T, D), and in words where they come from."""
    axes = [axis for axis in "xyz" if axis in columns]
    scales = [scale(table, columns[axis], "length", options.length_unit) for axis in axes]
    named = ", ".join(repr(table.headers[columns[axis]]) for axis in axes)
    units = sorted({f"{_WORDS[unit]} ({_SOURCES[source]})" for _, unit, source in scales})
    position = table.numbers[:, [columns[axis] for axis in axes]] / [per for per, _, _ in scales]
    return position, f"{named}: {' and '.join(units)}{', in the plane' if len(axes) == 2 else ''}"


def orientations(table: Table, columns: dict[str, int], options: ImportOptions) -> tuple[Array | None, str]:
    """Return quaternions w, x, y, z of any length, or None, and in words where they come from.

    Raises:
        InvalidDemonstration: When the order of a quaternion, the kind of a rotation or a unit is open.
    """
    if {"qw", "qx", "qy", "qz"} <= columns.keys():
        return _quaternion(table, columns, [columns[f"q{axis}"] for axis in "wxyz"], "quaternion")
    if {"q0", "q1", "q2", "q3"} <= columns.keys():
        order = table.order if options.quaternion_order == "auto" else options.quaternion_order
        if not order:
            four = ", ".join(repr(table.headers[columns[f"q{n}"]]) for n in range(4))
            raise _invalid(
                "header", f"the order of the quaternion in {four}: --quaternion-order xyzw or wxyz"
            )
        return _quaternion(
            table, columns, [columns[f"q{order.index(axis)}"] for axis in "wxyz"], f"quaternion {order}"
        )
    for names, known in ((("roll", "pitch", "yaw"), "xyz"), (("rx", "ry", "rz"), None)):
        if set(names) <= columns.keys():
            return _from_three(table, [columns[name] for name in names], options.rotation or known, options)
    if {"x", "y", "yaw"} <= columns.keys() and "z" not in columns:
        half = 0.5 * _angles(table, [columns["yaw"]], options)[:, 0]
        quat = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
        return quat, f"angle {table.headers[columns['yaw']]!r}"
    if more := [table.headers[n] for role, n in columns.items() if role not in ("x", "y", "z")]:
        expected = (
            f"all columns of an orientation, got only {', '.join(map(repr, more))}: name the others with --columns, or "
            "leave these out: --columns qx=- and so on"
        )
        raise _invalid("header", expected)
    return None, "none"


def _quaternion(
    table: Table, columns: dict[str, int], four: list[int], told: str
) -> tuple[Array | None, str]:
    quat = table.numbers[:, four]
    if "z" not in columns:
        return None, "left out: a motion in the plane has none"
    if np.nanmax(np.abs(quat), initial=0.0) == 0.0:
        return None, "none: all numbers of the quaternion are 0"
    return quat, f"{told} in {', '.join(repr(table.headers[n]) for n in four)} (w, x, y, z)"


def _from_three(
    table: Table, three: list[int], meaning: str | None, options: ImportOptions
) -> tuple[Array, str]:
    from scipy.spatial.transform import Rotation  # takes long to import, and few recordings need it

    named = ", ".join(repr(table.headers[n]) for n in three)
    if meaning is None:
        raise _invalid("header", f"the kind of rotation in {named}: --rotation rotvec, xyz, XYZ, ZYX, ...")
    angles = _angles(table, three, options)
    if meaning == "rotvec":
        turned = Rotation.from_rotvec(np.nan_to_num(angles))
    else:  # the columns are the turns about x, y and z, whichever is made first
        turned = Rotation.from_euler(
            meaning, np.nan_to_num(angles[:, ["xyz".index(a) for a in meaning.lower()]])
        )
    quat = turned.as_quat(scalar_first=True)
    quat[np.isnan(angles).any(axis=1)] = np.nan
    return quat, f"{'rotation vector' if meaning == 'rotvec' else f'Euler angles {meaning}'} in {named}"


def _angles(table: Table, columns: list[int], options: ImportOptions) -> Array:
    scales = [scale(table, n, "angle", options.angle_unit) for n in columns]
    if any(not source for _, _, source in scales):
        named = ", ".join(repr(table.headers[n]) for n in columns)
        raise _invalid("header", f"the unit of the angles in {named}: --angle-unit deg or rad")
    return table.numbers[:, columns] / [per for per, _, _ in scales]


def _invalid(field: str, expected: str) -> InvalidDemonstration:
    return InvalidDemonstration("recording", field, expected)
