"""The demonstration under way: the hand's events, resampled to one rate, on disk each second."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.errors import InvalidDemonstration
from local_site.raw_recording import RawRecording

Array = NDArray[np.float64]

PERIOD_S = 0.02
"""Strokes are resampled to this period, whatever the rate of the hand's events [s]."""
_RAW = "under-way.jsonl"
_MAX_PAUSE_S = 600.0
"""The hand reports nothing while it rests; after longer than this its clock is wrong [s]."""


class Recording:
    """Points at `0, PERIOD_S, 2 PERIOD_S, …` after the first event.

    Args:
        folder: Where the samples are kept meanwhile.
        n_dims: Dimension D of the positions.
    """

    def __init__(self, folder: Path, n_dims: int):
        self._n_dims = n_dims
        self._raw = RawRecording(folder / _RAW, n_dims)
        self.left_over = self._raw.left_over()
        """What was recorded and neither ended nor undone before it was rolled back, or its process ended; None
        when there is nothing."""
        self.points: list[Array] = []
        """The resampled positions. Each of shape (D,) [m]."""
        self.times_s: list[float] = []
        """Their times since the first one [s]."""
        self._began_s = 0.0
        self._last: tuple[Array, float] = (np.zeros(n_dims), 0.0)

    def begin(self) -> None:
        """A new demonstration begins; one that was left over is written over from now on."""
        self.left_over = None
        self._clear()

    def hand(self, position_m: Array, time_s: float) -> tuple[Array, Array]:
        """Take an event of the hand; between two events it moved straight.

        Returns:
            The new points (n, D) [m] and their times (n,) [s].

        Raises:
            InvalidDemonstration: When the position has another dimension, a number is not finite, or time
                runs backwards or jumps; nothing is taken.
        """
        position = np.array(position_m, dtype=float)
        self._check(position, time_s)
        n = len(self.points)
        if n == 0:
            self._began_s, points, times = time_s, position[None], np.zeros(1)
        else:
            from_position, from_s = self._last
            # A point that is due within a rounding error is due.
            due = int(np.floor((time_s - self._began_s) / PERIOD_S + 1e-9)) + 1
            times: Array = PERIOD_S * np.arange(float(n), float(max(due, n)))
            part = np.clip((self._began_s + times - from_s) / max(time_s - from_s, 1e-9), 0.0, 1.0)[:, None]
            points = from_position + part * (position - from_position)
        self._last = position, time_s
        self.points.extend(points)
        self.times_s.extend(times.tolist())
        self._raw.follow(self.points, self.times_s)
        return points, times

    def forget(self) -> None:
        """It was ended or undone."""
        self._clear()
        self._raw.forget()

    def set_aside(self) -> None:
        """It was given up; it can be had again, also by a later process."""
        self.left_over = self._raw.set_aside(self.points, self.times_s)
        self._clear()

    def _clear(self) -> None:
        self.points, self.times_s = [], []

    def _check(self, position_m: Array, time_s: float) -> None:
        if position_m.shape != (self._n_dims,) or not np.isfinite(position_m).all():
            raise _invalid("position_m", f"{self._n_dims} finite numbers, got {position_m.tolist()}")
        if not np.isfinite(time_s):
            raise _invalid("time_s", f"a finite number, got {time_s}")
        if self.points and not 0.0 <= time_s - self._last[1] <= _MAX_PAUSE_S:
            raise _invalid(
                "time_s", f"from 0 to {_MAX_PAUSE_S:g} s after {self._last[1]:g} s, got {time_s:g} s"
            )


def _invalid(field: str, expected: str) -> InvalidDemonstration:
    return InvalidDemonstration("demonstration", field, expected)
