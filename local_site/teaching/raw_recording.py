"""Samples of the demonstration in progress, on disk each second, so that a crash does not lose them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.common.log import loop_logger
from farhand.common.model.manifold import Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.whole_file import fault_of, read_whole
from farhand.local_site.teaching.demonstration import Demonstration

_log = loop_logger(__name__)

_PERIOD_S = 1.0


class _Within(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """First line of the file: the task frames, which stand still meanwhile."""

    frame_origin_m: list[list[float]]
    frame_rotation: list[list[list[float]]]

    @classmethod
    def of(cls, frames: Sequence[TaskFrame]) -> _Within:
        return cls([frame.b.tolist() for frame in frames], [frame.A.tolist() for frame in frames])

    def frames(self) -> list[TaskFrame]:
        pairs = zip(self.frame_rotation, self.frame_origin_m, strict=True)
        return [TaskFrame(np.array(A), np.array(b)) for A, b in pairs]


class RawRecording:
    """File of JSON lines: the task frames, then `[t, ...]` with a point's coordinates for each sample.

    It exists only while a demonstration is recorded.

    Args:
        path: Path of the file; its folder is made.
        space: Space of the samples.
        frame_names: Names of the task frames.
    """

    def __init__(self, path: Path, space: Manifold, frame_names: tuple[str, ...]):
        self._path, self._space, self._frame_names = path, space, frame_names
        self._within = b""
        self._written = 0
        self._written_s = -np.inf

    def begin(self, frames: Sequence[TaskFrame]) -> None:
        """Begin a demonstration within these task frames."""
        self._within = msgspec.json.encode(_Within.of(frames)) + b"\n"
        self._written, self._written_s = 0, -np.inf

    def follow(self, points: list[NDArray[np.float64]], times_s: list[float]) -> None:
        """Append the samples of the last second, once it is over. The arguments hold all samples so far."""
        if times_s and not 0.0 <= times_s[-1] - self._written_s < _PERIOD_S:
            self._write(points, times_s)

    def set_aside(self, points: list[NDArray[np.float64]], times_s: list[float]) -> Demonstration | None:
        """Keep all samples of a demonstration that is given up; `left_over` returns them."""
        if times_s:
            self._write(points, times_s)
        self._written, self._written_s = 0, -np.inf
        return self.left_over()

    def _write(self, points: list[NDArray[np.float64]], times_s: list[float]) -> None:
        self._written_s = times_s[-1]
        rows = zip(times_s[self._written :], points[self._written :], strict=True)
        lines = b"".join(msgspec.json.encode([float(t), *point.tolist()]) + b"\n" for t, point in rows)
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("ab" if self._written else "wb") as file:
                file.write(lines if self._written else self._within + lines)
        except OSError as error:
            _log.warning("the samples could not be written to %s: %s", self._path, error.strerror)
        else:
            self._written = len(times_s)

    def forget(self) -> None:
        """Remove the file: the demonstration was ended or undone."""
        self._written, self._written_s = 0, -np.inf
        try:
            self._path.unlink(missing_ok=True)
        except OSError as error:
            _log.warning("%s could not be removed: %s", self._path, error.strerror)

    def left_over(self) -> Demonstration | None:
        """Return the unfinished demonstration of an earlier process; None when there is none."""
        try:
            with fault_of(self._path, InvalidDemonstration, "the samples of a demonstration"):
                first, *lines = read_whole(self._path).splitlines()
                frames = msgspec.json.decode(first, type=_Within).frames()
                table = np.array(self._rows(lines))
                return Demonstration.within(frames, self._frame_names, table[:, 0], table[:, 1:])
        except InvalidDemonstration:
            return None  # no file, or no motion in it

    def _rows(self, lines: list[bytes]) -> list[list[float]]:
        """Return time and coordinates of each sample.

        Raises:
            ValueError: When one has another number of coordinates.
        """
        rows: list[list[float]] = []
        for line in lines:
            try:
                row = msgspec.json.decode(line, type=list[float])
            except ValueError:
                break  # a crash cut this line short
            if len(row) != 1 + self._space.n_coordinates:
                raise ValueError(f"a sample of {len(row)} numbers")
            rows.append(row)
        return rows
