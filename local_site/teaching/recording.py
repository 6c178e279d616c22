"""Demonstration in progress: the hand's events, resampled to one rate, on disk each second: a crash loses none."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration, InvalidInput
from farhand.common.log import loop_logger
from farhand.common.model.manifold import Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.whole_file import fault_of, read_whole
from farhand.local_site.learning.learner_settings import LearnerSettings
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.plausibility import REST_PART, REST_S, metres_per_radian, period_s

Array = NDArray[np.float64]

_log = loop_logger(__name__)
_PERIOD_S = 1.0
_RAW = "under-way.jsonl"
_MAX_PAUSE_S = 600.0
"""The hand reports nothing while it rests; after longer than this its clock is wrong [s]."""


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

    def follow(self, points: list[Array], times_s: list[float]) -> None:
        """Append the samples of the last second, once it is over. The arguments hold all samples so far."""
        if times_s and not 0.0 <= times_s[-1] - self._written_s < _PERIOD_S:
            self._write(points, times_s)

    def set_aside(self, points: list[Array], times_s: list[float]) -> Demonstration | None:
        """Keep all samples of a demonstration that is given up; `left_over` returns them."""
        if times_s:
            self._write(points, times_s)
        self._written, self._written_s = 0, -np.inf
        return self.left_over()

    def _write(self, points: list[Array], times_s: list[float]) -> None:
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


class Recording:
    """Points at regular times after the first event.

    Args:
        folder: Folder of the samples meanwhile.
        space: Space of the points.
        frame_names: Names of the task frames.
        settings: Settings of the learner, whose lambda defines a rest.
    """

    def __init__(
        self, folder: Path, space: Manifold, frame_names: tuple[str, ...], settings: LearnerSettings
    ):
        self._space, self._frame_names, self._period_s = space, frame_names, period_s(space)
        self._rest_m, self._radian_m = REST_PART * settings.max_distance_m, metres_per_radian(settings)
        self._begins: int | None = None
        self._raw = RawRecording(folder / _RAW, space, frame_names)
        self.frames: tuple[TaskFrame, ...] = ()
        """Task frames, which stand still."""
        self.left_over = self._raw.left_over()
        """Recording that was neither ended nor undone; None without one."""
        self.points: list[Array] = []
        """Resampled points. Each of shape (C,)."""
        self.times_s: list[float] = []
        """Times of the points since the first one [s]."""
        self._began_s = 0.0
        self._last: tuple[Array, float] = (np.zeros(space.n_coordinates), 0.0)

    def begin(self, frames: Sequence[TaskFrame]) -> None:
        """Begin a demonstration; it overwrites an unfinished one."""
        self.left_over, self.frames = None, tuple(frames)
        self._raw.begin(frames)
        self._clear()

    def hand(self, point: Array, time_s: float) -> tuple[Array, Array]:
        """Take an event; between two events the motion is linear.

        Args:
            point: Position or pose. Shape (C,).
            time_s: Time of the event [s].

        Returns:
            The new points (n, C) and their times (n,) [s]: none while the hand rests at the beginning,
            which is cut short, then all so far.

        Raises:
            InvalidDemonstration: When this is no point of the space, or time runs backwards or jumps; nothing
                is taken.
        """
        point = self._checked(point, time_s)
        n, space = len(self.points), self._space
        if n == 0:
            self._began_s, points, times = time_s, point[None], np.zeros(1)
        else:
            before, from_s = self._last
            # A point that is due within a rounding error counts as due.
            due = int(np.floor((time_s - self._began_s) / self._period_s + 1e-9)) + 1
            times: Array = self._period_s * np.arange(float(n), float(max(due, n)))
            part = np.clip((self._began_s + times - from_s) / max(time_s - from_s, 1e-9), 0.0, 1.0)[:, None]
            points = space.exp(before, part * space.log(before, point))
        self._last = point, time_s
        self.points.extend(points)
        self.times_s.extend(times.tolist())
        self._raw.follow(self.points, self.times_s)
        if self.resting:
            moved = space.distance(self.points[0], points, self._radian_m) > self._rest_m
            if not moved.any():
                return np.empty((0, space.n_coordinates)), np.empty(0)
            self._begins = max(0, n + int(np.argmax(moved)) - round(REST_S / self._period_s))
            n, points = self._begins, np.array(self.points[self._begins :])
        return points, self._times(n, n + len(points))

    def demonstration(self) -> Demonstration:
        """Return the whole demonstration, without a rest at its beginning."""
        begins, n = self._begins or 0, len(self.points)
        points = np.array(self.points[begins:])
        return Demonstration.within(self.frames, self._frame_names, self._times(begins, n), points)

    def forget(self) -> None:
        """Forget the demonstration: it was ended or undone."""
        self._clear()
        self._raw.forget()

    def forget_left_over(self) -> None:
        """Forget the unfinished demonstration: it was learned."""
        self.left_over = None
        self._raw.forget()

    def set_aside(self) -> None:
        """Give the demonstration up, recoverably, also for a later process."""
        self.left_over = self._raw.set_aside(self.points, self.times_s)
        self._clear()

    @property
    def resting(self) -> bool:
        """True while the motion has not begun, so that nothing was given out to be learned."""
        return self._begins is None

    def _times(self, first: int, end: int) -> Array:
        """Return the times of samples, from the beginning of the motion [s]."""
        begins = self._begins or 0
        return self._period_s * np.arange(float(first - begins), float(end - begins))

    def _clear(self) -> None:
        self.points, self.times_s, self._begins = [], [], None

    def _checked(self, point: Array, time_s: float) -> Array:
        try:
            point = self._space.checked(point, "demonstration", "point")
        except InvalidInput as error:
            raise _invalid(error.field, error.expected) from None
        if not np.isfinite(time_s):
            raise _invalid("time_s", f"a finite number, got {time_s}")
        if self.points and not 0.0 <= time_s - self._last[1] <= _MAX_PAUSE_S:
            raise _invalid(
                "time_s", f"from 0 to {_MAX_PAUSE_S:g} s after {self._last[1]:g} s, got {time_s:g} s"
            )
        return point


def _invalid(field: str, expected: str) -> InvalidDemonstration:
    return InvalidDemonstration("demonstration", field, expected)
