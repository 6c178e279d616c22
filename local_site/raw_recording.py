"""The samples of the demonstration under way, on disk each second, so that a crash does not lose them."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from common.log import loop_logger
from local_site.samples import Stroke

_log = loop_logger(__name__)

_PERIOD_S = 1.0


class RawRecording:
    """One file of JSON lines `[t, x, y(, z)]`; it exists only while a demonstration is recorded.

    Args:
        path: Where it is; its folder is made.
        n_dims: Dimension D of the samples.
    """

    def __init__(self, path: Path, n_dims: int):
        self._path, self._n_dims = path, n_dims
        self._written = 0
        self._written_s = -np.inf

    def follow(self, points: list[NDArray[np.float64]], times_s: list[float]) -> None:
        """Append what was recorded since the last second, if that is over. All samples so far are given."""
        if times_s and not 0.0 <= times_s[-1] - self._written_s < _PERIOD_S:
            self._write(points, times_s)

    def set_aside(self, points: list[NDArray[np.float64]], times_s: list[float]) -> Stroke | None:
        """Keep all samples of a demonstration that is given up; they are given back as `left_over` does."""
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
                file.write(lines)
        except OSError as error:
            _log.warning("the samples could not be written to %s: %s", self._path, error.strerror)
        else:
            self._written = len(times_s)

    def forget(self) -> None:
        """The demonstration was ended or undone."""
        self._written, self._written_s = 0, -np.inf
        try:
            self._path.unlink(missing_ok=True)
        except OSError as error:
            _log.warning("%s could not be removed: %s", self._path, error.strerror)

    def left_over(self) -> Stroke | None:
        """What an earlier process had recorded and neither ended nor undone; None when there is nothing."""
        try:
            lines = self._path.read_bytes().splitlines()
        except OSError:
            return None
        rows: list[list[float]] = []
        for line in lines:
            try:
                row = msgspec.json.decode(line, type=list[float])
            except msgspec.DecodeError:
                break  # the crash came in the middle of this line
            if len(row) != 1 + self._n_dims:
                return None
            rows.append(row)
        if len(rows) < 2:
            return None
        table = np.array(rows)
        return Stroke(position_m=table[:, 1:], time_s=table[:, 0])
