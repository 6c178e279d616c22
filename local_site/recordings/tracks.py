"""Tracks: the poses of one body over time in metres, seconds and quaternions, mended by rule or refused by row.

Left out are rows without numbers and rows that repeat the one before; a quaternion of nearly unit length is made one, and
keeps its sign from row to row. Refused are times that go back, and numbers that are none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.common.model.manifold import POSE
from farhand.local_site.recordings.columns import Roles, Table
from farhand.local_site.recordings.options import ImportOptions
from farhand.local_site.recordings.quantities import orientations, positions, times
from farhand.local_site.teaching.plausibility import gap_of

Array = NDArray[np.float64]

FRAME_GAP_S = 0.5
"""A body is known for so long before and after each of its samples [s]."""
_UNIT_TOLERANCE = 0.02


@dataclass(frozen=True, eq=False)
class Track:
    """Motion of a body.

    Args:
        name: Of the body.
        time_s: Times on the recording's clock, increasing [s]. Shape (T,).
        position_m: Within the parent [m]. Shape (T, D).
        quat_wxyz: Orientations; None where there are none. Shape (T, 4).
        rows: Number of each sample in the file. Shape (T,).
        row: What the file calls a row.
        parent: Name of the frame that the poses are in.
        told: What was understood and mended, for the preview.
    """

    name: str
    time_s: Array
    position_m: Array
    quat_wxyz: Array | None
    rows: NDArray[np.int64]
    row: str
    parent: str
    told: tuple[tuple[str, str], ...]

    @property
    def fixed(self) -> bool:
        """True if every sample has the same pose, which holds at all times: TF repeats what stands still."""
        poses = (self.position_m,) if self.quat_wxyz is None else (self.position_m, self.quat_wxyz)
        return not any(np.ptp(array, axis=0).any() for array in poses)

    def at(self, time_s: Array) -> Track:
        """Return the poses at other times, straight between two samples.

        Raises:
            InvalidDemonstration: When the body was not seen at about one of the times.
        """
        if self.fixed:
            keep = np.zeros(len(time_s), dtype=int)
            quat = None if self.quat_wxyz is None else self.quat_wxyz[keep]
            return replace(
                self, time_s=time_s, position_m=self.position_m[keep], quat_wxyz=quat, rows=self.rows[keep]
            )
        before = np.clip(np.searchsorted(self.time_s, time_s, side="right") - 1, 0, len(self.time_s) - 2)
        begin_s, end_s = self.time_s[before], self.time_s[before + 1]
        part = np.clip((time_s - begin_s) / (end_s - begin_s), 0.0, 1.0)
        inside = (part > 0.0) & (part < 1.0)
        away_s = np.maximum(begin_s - time_s, time_s - end_s)
        unknown = np.flatnonzero((away_s > FRAME_GAP_S) | (inside & (end_s - begin_s > 2 * FRAME_GAP_S)))
        if unknown.size:
            n = unknown[0]
            expected = (
                f"{self.name} to be recorded during the whole motion, but at {time_s[n] - time_s[0]:.3f} s of it there is none, "
                f"after {self.row} {self.rows[before[n]]}: cut the recording, or give the frame by hand, --frames NAME=X,Y,Z"
            )
            raise _invalid("--frames", expected)
        position = self.position_m[before] + part[:, None] * (
            self.position_m[before + 1] - self.position_m[before]
        )
        quat = self.quat_wxyz
        quat = None if quat is None else _between(quat[before], quat[before + 1], part[:, None])
        return replace(self, time_s=time_s, position_m=position, quat_wxyz=quat, rows=self.rows[before])


def track_of(table: Table, roles: Roles, body: str, options: ImportOptions) -> Track:
    """Return the track of one body of a table.

    Raises:
        InvalidDemonstration: Naming the row and column at fault, and what to do.
    """
    columns = roles.bodies[body]
    for index in [*(n for role, n in roles.time.items() if role in ("t", "nanosec")), *columns.values()]:
        if index in table.texts:
            row, text = table.texts[index][0]
            expected = f"a number, got {text[:40]!r}: mend it, or leave it blank"
            raise _invalid(f"{table.row} {row}, column {table.headers[index]!r}", expected)
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is refused below
        time_s, time_told = times(table, roles.time, options)
        position, position_told = positions(table, columns, options)
        quat, quat_told = orientations(table, columns, options)
        values = np.concatenate([time_s[:, None], position, *([quat] if quat is not None else [])], axis=1)
    infinite = np.flatnonzero(np.isinf(values).any(axis=1))
    if infinite.size:
        raise _invalid(
            f"{table.row} {table.rows[infinite[0]]}",
            "finite numbers, got inf: leave the cell blank, or delete the row",
        )
    keep, mended = _kept(table, values)
    if quat is not None:
        quat, turned = _unit(table, quat[keep], table.rows[keep])
        mended += turned if {"qw", "q0"} & columns.keys() else ()
    told = (("time", time_told), ("position", position_told), ("orientation", quat_told), *mended)
    return Track(body, time_s[keep], position[keep], quat, table.rows[keep], table.row, table.parent, told)


def check_gaps(motion: Track) -> None:
    """Refuse a motion in whose middle something is missing.

    Raises:
        InvalidDemonstration: Naming the rows.
    """
    found = gap_of(motion.time_s)
    if found is not None:
        n, gap_s, most_s = found
        row, rows = motion.row, motion.rows
        expected = (
            f"no gap of more than {most_s:g} s, but {motion.name or 'the motion'} is not recorded for {gap_s:.3g} s until "
            f"{row} {rows[n + 1]}: cut the recording there, or record it again"
        )
        raise _invalid(f"{row} {rows[n]}", expected)


def _kept(table: Table, values: Array) -> tuple[NDArray[np.bool_], tuple[tuple[str, str], ...]]:
    """Return which rows have all numbers and a time of their own, and what was left out."""
    told = list[tuple[str, str]]()
    blank = np.isnan(values).any(axis=1)
    keep = np.asarray(~blank)
    if blank.all():
        raise _invalid("", f"a {table.row} with all numbers of time and pose, got none")
    if blank.any():
        told.append(
            (
                "mended",
                f"{blank.sum()} {table.row}s without all numbers left out, from {table.row} {table.rows[blank][0]}",
            )
        )
    index = np.flatnonzero(keep)
    rows, times_s = table.rows[index], values[index, 0]
    steps_s = np.diff(times_s)
    back = np.flatnonzero(steps_s < 0)
    if back.size:
        n = back[0]
        expected = f"a later time than in {table.row} {rows[n]}, got {-steps_s[n]:g} s before it: sort the {table.row}s, or cut the file there"
        raise _invalid(f"{table.row} {rows[n + 1]}", expected)
    twice = np.flatnonzero(steps_s == 0)
    for n in twice:
        if not np.allclose(values[index[n], 1:], values[index[n + 1], 1:], rtol=0.0, atol=1e-9):
            expected = f"another time than in {table.row} {rows[n]}, or the same pose: delete one of the two"
            raise _invalid(f"{table.row} {rows[n + 1]}", expected)
    if twice.size:
        keep[index[twice + 1]] = False
        told.append(
            ("mended", f"{twice.size} repeated {table.row}s left out, from {table.row} {rows[twice[0] + 1]}")
        )
    return keep, tuple(told)


def _unit(table: Table, quat: Array, rows: NDArray[np.int64]) -> tuple[Array, tuple[tuple[str, str], ...]]:
    """Return quaternions of unit length that keep their sign, and what was changed."""
    length = np.linalg.norm(quat, axis=1)
    bad = np.flatnonzero(np.abs(length - 1.0) > _UNIT_TOLERANCE)
    if bad.size:
        expected = f"a quaternion of length 1, got length {length[bad[0]]:.3g}: mend or delete it, or name the right columns with --columns"
        raise _invalid(f"{table.row} {rows[bad[0]]}", expected)
    quat = quat / length[:, None]
    flips = np.sum(quat[1:] * quat[:-1], axis=1) < 0
    signs = np.concatenate([[1.0], np.cumprod(np.where(flips, -1.0, 1.0))])
    told = (
        (
            (
                "mended",
                f"{flips.sum()} changes of the quaternion's sign, from {table.row} {rows[1:][flips][0]}",
            ),
        )
        if flips.any()
        else ()
    )
    return quat * signs[:, None], told


def _between(first: Array, second: Array, part: Array) -> Array:
    """Return the orientations on the shortest way between two. Shapes (T, 4), (T, 4), (T, 1)."""
    zeros = np.zeros((len(first), 3))
    a, b = np.hstack([zeros, first]), np.hstack([zeros, second])
    return POSE.exp(a, part * POSE.log(a, b))[:, 3:]


def _invalid(field: str, expected: str) -> InvalidDemonstration:
    return InvalidDemonstration("recording", field, expected)
