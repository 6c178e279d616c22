"""What the operator has taught: demonstrations as they are made, the model they make, one step back."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.errors import FarhandError, InvalidDemonstration
from common.model_file import content_hash, encode
from common.model_file import save as save_model
from common.task import Task
from common.task_frame import TaskFrame
from common.tphsmm import TPHSMM
from local_site.demonstration import Demonstration
from local_site.learning.online_learner import LearnerSettings, OnlineLearner, Snapshot
from local_site.raw_recording import RawRecording
from local_site.samples import Stroke

Array = NDArray[np.float64]

LEARNING_PERIOD_S = 0.02
"""Strokes are resampled to this period, whatever the rate of the hand's events [s]."""
_NEWEST = "newest.farhand"
_RAW = "under-way.jsonl"
_MIN_SAMPLES = 5
_MAX_PAUSE_S = 600.0
"""The hand reports nothing while it rests; after longer than this its clock is wrong [s]."""


class NotSaved(FarhandError):
    """What was learned or undone counts, but could not be written to disk."""


class NotNow(FarhandError):
    """The operator asked for something that is not possible at this moment; says why."""


@dataclass(frozen=True)
class LearnedModel:
    """A model with its bytes.

    Args:
        model: What was learned.
        content: As it travels.
        sha256: Of the content.
        version: Counts the models that were learned here.
        parent_sha256: The model that it was refined from, empty for the first.
    """

    model: TPHSMM
    content: bytes
    sha256: str
    version: int = 1
    parent_sha256: str = ""


class TaskLibrary:
    """Teaches one task: record, end, undo.

    Args:
        task: The task; its target stands still on the operator's side.
        data_dir: Where demonstrations and models are kept.
    """

    def __init__(self, task: Task, data_dir: Path):
        self._task = task
        self._folder = data_dir / task.name
        lambda_m = task.learning.max_distance_m or 0.25 * float(max(task.workspace_m))
        settings = LearnerSettings(max_distance_m=lambda_m, min_std_m=task.learning.min_std_m)
        self._learner = OnlineLearner(settings, task.n_dims, task.frame_names)
        self.frames = [TaskFrame(np.eye(task.n_dims), np.array(task.target.origin_m))] * len(task.frame_names)
        self._undo: list[tuple[Snapshot, tuple[Array, ...]]] = []
        self.strokes: tuple[Array, ...] = ()
        self.current: list[Array] = []
        self._times: list[float] = []
        self._last_hand: tuple[Array, float] = (np.zeros(task.n_dims), 0.0)
        self._forming: tuple[int, TPHSMM] | None = None
        self.learned: LearnedModel | None = None
        self._version = 0
        self._raw = RawRecording(self._folder / _RAW, task.n_dims)
        self.left_over = self._raw.left_over()
        """What was recorded and neither ended nor undone before it was rolled back, or its process ended; None
        when there is nothing."""

    @property
    def recording(self) -> bool:
        """Whether a demonstration is being made."""
        return self._learner.demonstrating

    @property
    def can_undo(self) -> bool:
        """Whether there is something to forget."""
        return bool(self._undo)

    def record(self) -> None:
        """Begin a demonstration.

        Raises:
            NotNow: When one is being made already.
        """
        if self.recording:
            raise NotNow("a demonstration is being recorded already: end or undo it first")
        self.left_over = None  # its file is written over from now on
        self._undo.append((self._learner.snapshot(), self.strokes))
        self._learner.start()
        self.current, self._times, self._forming = [], [], None

    def hand(self, position_m: Array, time_s: float) -> None:
        """Learn from where the hand is now, at the learning rate; between two events it moved straight.

        Raises:
            InvalidDemonstration: When the position has another dimension, a number is not finite, or time
                runs backwards or jumps; nothing is learned.
        """
        position = np.array(position_m, dtype=float)
        self._check_hand(position, time_s)
        if not self.current:
            self._observe(position[None], np.array([time_s]))
        elif (n := int(np.floor((time_s - self._times[-1]) / LEARNING_PERIOD_S + 1e-9))) >= 1:
            from_position, from_s = self._last_hand
            times_s: Array = self._times[-1] + LEARNING_PERIOD_S * np.arange(1.0, n + 1.0)
            part = np.minimum((times_s - from_s) / (time_s - from_s), 1.0)[:, None]
            self._observe(from_position + part * (position - from_position), times_s)
        self._last_hand = position, time_s

    def end(self) -> LearnedModel:
        """Keep the demonstration and make the model.

        Raises:
            NotNow: When none is being made, or it is too short to learn from; then it is forgotten.
            NotSaved: When it was learned, but could not be written to disk.
        """
        if not self.recording:
            raise NotNow("no demonstration is being recorded: press Record first")
        if len(self.current) < _MIN_SAMPLES:
            self.undo()
            raise NotNow("the demonstration was too short and was not kept: draw the whole motion")
        self._learner.end()
        self._raw.forget()
        demonstration = self._demonstration()
        self.strokes = (*self.strokes, demonstration.position_m)
        self.current, self._times, self._forming = [], [], None
        learned = self._update_model()
        assert learned is not None
        name = f"demonstration-{time.strftime('%Y%m%dT%H%M%S')}-{len(self.strokes):02d}.npz"
        with self._on_disk() as folder:
            demonstration.save(folder / name)
            save_model(learned.model, folder / _NEWEST)
        return learned

    def recover(self) -> None:
        """Learn what an earlier process had recorded.

        Raises:
            NotNow: When there is nothing, or a demonstration is being recorded.
        """
        if self.left_over is None:
            raise NotNow("there is no demonstration to recover")
        self.learn([self.left_over])

    def learn(self, strokes: Sequence[Stroke]) -> None:
        """Learn whole demonstrations, one after the other.

        Raises:
            NotNow: When one is being recorded.
            InvalidDemonstration: When one is no motion, see `hand`; it is forgotten.
        """
        for stroke in strokes:
            self.record()
            try:
                for position, time_s in zip(stroke.position_m, stroke.time_s, strict=True):
                    self.hand(position, float(time_s))
            except InvalidDemonstration:
                self.undo()
                raise
            self.end()

    def undo(self) -> None:
        """Put everything back to before the last demonstration, bit for bit.

        Raises:
            NotNow: When there is none.
            NotSaved: When it was undone, but not on disk.
        """
        if not self._undo:
            raise NotNow("there is no demonstration to undo")
        if self.recording:
            self._raw.forget()
        self._put_back()

    def set_aside(self) -> None:
        """Put everything back to before the demonstration under way, and offer its samples again.

        Raises:
            NotSaved: When it was put back, but not on disk.
        """
        self.left_over = self._raw.set_aside(self.current, self._times)
        self._put_back()

    def _put_back(self) -> None:
        snapshot, self.strokes = self._undo.pop()
        self._learner.restore(snapshot)
        self.current, self._times, self._forming = [], [], None
        learned = self._update_model()
        with self._on_disk() as folder:
            if learned is None:
                (folder / _NEWEST).unlink(missing_ok=True)
            else:
                save_model(learned.model, folder / _NEWEST)

    def forming(self) -> TPHSMM | None:
        """The model as it is in the middle of a demonstration; None without one, or before its first point."""
        if not self.current:
            return None
        if self._forming is None or self._forming[0] != len(self.current):
            self._forming = (len(self.current), self._learner.model())
        return self._forming[1]

    def _check_hand(self, position_m: Array, time_s: float) -> None:
        if not self.recording:
            raise InvalidDemonstration("demonstration", "", "start the demonstration first")
        if position_m.shape != (self._task.n_dims,) or not np.isfinite(position_m).all():
            expected = f"{self._task.n_dims} finite numbers, got {position_m.tolist()}"
            raise InvalidDemonstration("demonstration", "position_m", expected)
        if not np.isfinite(time_s):
            raise InvalidDemonstration("demonstration", "time_s", f"a finite number, got {time_s}")
        if self.current and not 0.0 <= time_s - self._last_hand[1] <= _MAX_PAUSE_S:
            expected = f"from 0 to {_MAX_PAUSE_S:g} s after {self._last_hand[1]:g} s, got {time_s:g} s"
            raise InvalidDemonstration("demonstration", "time_s", expected)

    def _observe(self, points: Array, times_s: Array) -> None:
        self._learner.observe_many(points, self.frames, times_s.tolist())
        self.current.extend(points)
        self._times.extend(times_s)
        self._raw.follow(self.current, self._times)

    def _update_model(self) -> LearnedModel | None:
        """Make the model of all ended demonstrations; None without any."""
        parent, self.learned = self.learned, None
        if self._learner.n_demonstrations:
            model = self._learner.model()
            content = encode(model)
            self._version += 1
            parent_sha256 = parent.sha256 if parent is not None else ""
            self.learned = LearnedModel(model, content, content_hash(content), self._version, parent_sha256)
        return self.learned

    def _demonstration(self) -> Demonstration:
        """The one that is being recorded, as it goes into its file."""
        return Demonstration(
            time_s=np.array(self._times) - self._times[0],
            position_m=np.array(self.current),
            frame_origin_m=np.array([frame.b for frame in self.frames]),
            frame_rotation=np.array([frame.A for frame in self.frames]),
            frame_names=self._task.frame_names,
        )

    @contextmanager
    def _on_disk(self) -> Iterator[Path]:
        """The task's folder, to write into."""
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            yield self._folder
        except OSError as error:
            raise NotSaved(
                f"kept in memory only: {self._folder} cannot be written ({error.strerror})"
            ) from error
