"""What the operator has taught: demonstrations as they are made, the model they make, one step back."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.errors import FarhandError
from common.model_file import content_hash, encode
from common.model_file import save as save_model
from common.task import Task
from common.task_frame import TaskFrame
from common.tphsmm import TPHSMM
from local_site.demonstration import Demonstration
from local_site.learning.online_learner import LearnerSettings, OnlineLearner, Snapshot
from local_site.samples import Stroke

Array = NDArray[np.float64]

LEARNING_PERIOD_S = 0.02
"""Strokes are resampled to this period, whatever the rate of the hand's events [s]."""
_MIN_SAMPLES = 5


class NotNow(FarhandError):
    """The operator asked for something that is not possible at this moment; says why."""


@dataclass(frozen=True)
class LearnedModel:
    """A model with its bytes.

    Args:
        model: What was learned.
        content: As it travels.
        sha256: Of the content.
    """

    model: TPHSMM
    content: bytes
    sha256: str


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
        self.learned: LearnedModel | None = None

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
        self._undo.append((self._learner.snapshot(), self.strokes))
        self._learner.start()
        self.current, self._times = [], []

    def hand(self, position_m: Array, time_s: float) -> None:
        """Learn from where the hand is now, at the learning rate; between two events it moved straight.

        Raises:
            InvalidDemonstration: When a number is not finite or time runs backwards; nothing is learned.
        """
        if not self.current:
            self._observe(np.array([position_m]), np.array([time_s]))
            return
        n = int(np.floor((time_s - self._times[-1]) / LEARNING_PERIOD_S + 1e-9))
        if n >= 1:
            part = np.arange(1, n + 1)[:, None] * LEARNING_PERIOD_S / (time_s - self._times[-1])
            last = self.current[-1]
            self._observe(last + np.minimum(part, 1.0) * (np.asarray(position_m) - last), self._grid(n))

    def end(self) -> LearnedModel:
        """Keep the demonstration and make the model.

        Raises:
            NotNow: When none is being made, or it is too short to learn from; then it is forgotten.
        """
        if not self.recording:
            raise NotNow("no demonstration is being recorded: press Record first")
        if len(self.current) < _MIN_SAMPLES:
            self.undo()
            raise NotNow("the demonstration was too short and was not kept: draw the whole motion")
        self._learner.end()
        points = np.array(self.current)
        self.strokes = (*self.strokes, points)
        self._save_demonstration(points)
        self._publish()
        assert self.learned is not None
        return self.learned

    def learn(self, strokes: Sequence[Stroke]) -> None:
        """Learn whole demonstrations, one after the other.

        Raises:
            NotNow: When one is being recorded.
        """
        for stroke in strokes:
            self.record()
            for position, time_s in zip(stroke.position_m, stroke.time_s, strict=True):
                self.hand(position, float(time_s))
            self.end()

    def undo(self) -> None:
        """Put everything back to before the last demonstration, bit for bit.

        Raises:
            NotNow: When there is none.
        """
        if not self._undo:
            raise NotNow("there is no demonstration to undo")
        snapshot, self.strokes = self._undo.pop()
        self._learner.restore(snapshot)
        self.current, self._times = [], []
        self._publish()

    def _grid(self, n: int) -> Array:
        return np.array([self._times[-1] + LEARNING_PERIOD_S * step for step in range(1, n + 1)])

    def _observe(self, points: Array, times_s: Array) -> None:
        self._learner.observe_many(points, self.frames, times_s.tolist())
        self.current.extend(points)
        self._times.extend(times_s)

    def _publish(self) -> None:
        """Make the model of all ended demonstrations, on disk as well."""
        if self._learner.n_demonstrations == 0:
            self.learned = None
            return
        model = self._learner.model()
        content = encode(model)
        self.learned = LearnedModel(model, content, content_hash(content))
        self._folder.mkdir(parents=True, exist_ok=True)
        save_model(model, self._folder / "newest.farhand")

    def _save_demonstration(self, points: Array) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        demonstration = Demonstration(
            time_s=np.array(self._times) - self._times[0],
            position_m=points,
            frame_origin_m=np.array([frame.b for frame in self.frames]),
            frame_rotation=np.array([frame.A for frame in self.frames]),
            frame_names=self._task.frame_names,
        )
        stamp = time.strftime("%Y%m%dT%H%M%S")
        demonstration.save(self._folder / f"demonstration-{stamp}-{len(self.strokes):02d}.npz")
