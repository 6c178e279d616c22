"""Teaching of one task: recording of demonstrations, undo, and return to revisions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration, InvalidInput
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import AnyTask
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.goal import goal_miss, seen_from_goal
from farhand.local_site.teaching.lesson import LearnedModel, Lesson
from farhand.local_site.teaching.recording import Recording
from farhand.local_site.teaching.revisions import Revision
from farhand.local_site.teaching.teaching_permission import Act, NotNow, teaching_refusal

Array = NDArray[np.float64]

_MIN_SAMPLES = 5


class TaskLibrary:
    """Demonstrations and revisions of one task; those of earlier processes are loaded at the start.

    Args:
        task: Task to teach.
        data_dir: Folder of demonstrations and models.
    """

    def __init__(self, task: AnyTask, data_dir: Path):
        folder = data_dir / task.name
        self._task, self._taught = task, Lesson(task, folder)
        self._recording = Recording(folder, task.space, task.frame_names, self._taught.settings)
        self._forming: tuple[int, TPHSMM] | None = None

    @property
    def faults(self) -> tuple[str, ...]:
        """Losses found at the start: files that could not be read or kept."""
        return self._taught.faults

    @property
    def recording(self) -> bool:
        """True while a demonstration is recorded."""
        return self._taught.learner.demonstrating

    @property
    def current(self) -> list[Array]:
        """Points of the demonstration in progress. Each of shape (C,)."""
        return self._recording.points

    @property
    def left_over(self) -> Demonstration | None:
        """Unfinished demonstration, which was rolled back or whose process ended; None without one."""
        return self._recording.left_over

    @property
    def can_undo(self) -> bool:
        """True if a demonstration, or the removal of one, can be undone."""
        return self.recording or bool(self._taught.demonstrations or self._taught.before_removal)

    @property
    def can_recover(self) -> bool:
        """True if an unfinished demonstration was not learned yet."""
        return self.left_over is not None

    @property
    def demonstrations(self) -> tuple[Demonstration, ...]:
        """Demonstrations of the current revision."""
        return tuple(each.demonstration for each in self._taught.demonstrations)

    @property
    def demonstration_names(self) -> tuple[str, ...]:
        """Names of the files of these demonstrations."""
        return tuple(each.name for each in self._taught.demonstrations)

    @property
    def strokes(self) -> tuple[Array, ...]:
        """Demonstrations of the current revision, and the one in progress. Each of shape (T, C)."""
        ended = tuple(seen_from_goal(each) for each in self.demonstrations)
        return (*ended, np.array(self.current)) if self.recording and self.current else ended

    @property
    def stroke_frames(self) -> tuple[tuple[TaskFrame, ...], ...]:
        """Task frames at the end of each stroke. Each of length P."""
        ended = tuple(tuple(each.frames_at(-1)) for each in self.demonstrations)
        return (*ended, self._recording.frames) if self.recording and self.current else ended

    @property
    def learned(self) -> LearnedModel | None:
        """Model of all demonstrations; None without any."""
        return self._taught.learned

    @property
    def revisions(self) -> tuple[Revision, ...]:
        """Newest revisions, the newest last."""
        return self._taught.revisions

    @property
    def revision(self) -> int:
        """Number of the current revision, 0 before the first."""
        return self._taught.revision

    def forming(self) -> TPHSMM | None:
        """Return the model during a demonstration; None without one, or before its first movement."""
        n = len(self.current)
        if self._recording.resting:
            return None
        if self._forming is None or self._forming[0] != n:
            self._forming = (n, self._taught.learner.model())
        return self._forming[1]

    def miss(self) -> str:
        """Return how the demonstration in progress misses the task's goal so far; empty at the goal or without one."""
        if not self.recording or not self.current:
            return ""
        frame, point = self._recording.frames[-1], self.current[-1]
        return goal_miss(self._task, frame.to_local(np.asarray(point)))

    def record(self, frames: Sequence[TaskFrame]) -> None:
        """Begin a demonstration.

        Args:
            frames: Task frames of the workcell, which do not move during a demonstration. Length P.

        Raises:
            NotNow: When a demonstration is being recorded already.
        """
        self._check(Act.RECORD)
        self._recording.begin(frames)
        self._forming = None
        self._taught.learner.start()

    def hand(self, point: Array, time_s: float) -> None:
        """Learn from the present point of the hand, or of its arm, at the learning rate.

        See `Recording.hand`.

        Raises:
            InvalidDemonstration: When no demonstration is being recorded, or the point is impossible; nothing is learned.
        """
        if not self.recording:
            raise InvalidDemonstration("demonstration", "", "start the demonstration first")
        points, times_s = self._recording.hand(point, time_s)
        if len(points):
            self._taught.learner.observe_many(points, self._recording.frames, times_s)

    def end(self) -> LearnedModel:
        """End the demonstration, keep it, and make the model.

        Raises:
            NotNow: When no demonstration is being recorded, or nothing moved in it; then it is forgotten.
            NotSaved: When it was learned, but not written to disk.
        """
        self._check(Act.END)
        if len(self.current) < _MIN_SAMPLES:
            self.undo()
            raise NotNow("the demonstration was too short and was not kept: draw the whole motion")
        made = self._recording.demonstration()
        self._recording.forget()
        try:
            self._taught.end(made)
        except InvalidInput as error:
            raise NotNow(f"the demonstration was not kept: {error.field}: {error.expected}") from None
        assert self.learned is not None
        return self.learned

    def recover(self) -> None:
        """Learn the unfinished demonstration.

        Raises:
            NotNow: When there is no unfinished demonstration, or another one is being recorded.
        """
        self._check(Act.RECOVER)
        assert self.left_over is not None
        self.learn([self.left_over])
        self._recording.forget_left_over()

    def learn(self, demonstrations: Sequence[Demonstration]) -> None:
        """Learn whole demonstrations, at the learning rate: all of them or none.

        Raises:
            NotNow: When a demonstration is being recorded.
            InvalidDemonstration: When one has no motion that can be learned; nothing is learned.
            NotSaved: When they were learned, but not written to disk.
        """
        self._check(Act.LEARN)
        self._taught.learn(demonstrations)

    def lacking(self, demonstrations: Sequence[Demonstration]) -> list[Demonstration]:
        """Return the given demonstrations without those that are learned already."""
        return self._taught.lacking(demonstrations)

    def set_aside(self) -> None:
        """Roll the demonstration in progress back, and keep its samples for `recover`."""
        self._recording.set_aside()
        self._discard()

    def remove(self, name: str) -> None:
        """Remove one demonstration, see `Lesson.remove`.

        Raises:
            NotNow: When there is no such demonstration, or another one is being recorded.
        """
        self._check(Act.REMOVE, name=name)
        self._taught.remove(name)

    def undo(self) -> None:
        """Undo the last demonstration, the last ones that were learned together, or a removal, bit for bit.

        Raises:
            NotNow: When there is no demonstration.
            NotSaved: When it was undone, but not on disk.
        """
        self._check(Act.UNDO)
        if self.recording:
            self._recording.forget()
            self._discard()
        else:
            self._taught.undo()

    def go_to(self, number: int) -> None:
        """Make another revision current, see `Lesson.go_to`.

        Raises:
            NotNow: When there is no such revision, or a demonstration is being recorded.
        """
        self._check(Act.GO_TO, number)
        self._taught.go_to(number)

    def start_anew(self) -> None:
        """Begin without demonstrations; the present ones stay available as a revision.

        Raises:
            NotNow: When a demonstration is being recorded.
            NotSaved: When it was done, but not on disk.
        """
        self._check(Act.START_ANEW)
        self._taught.start_anew()

    def delete(self, number: int) -> None:
        """Delete a revision that is not current, see `Lesson.delete`.

        Raises:
            NotNow: When it is current or does not exist, or a demonstration is being recorded.
        """
        self._check(Act.DELETE, number)
        self._taught.delete(number)

    def _check(self, act: Act, number: int = 0, name: str = "") -> None:
        if (why := teaching_refusal(act, self, number, name)) is not None:
            raise NotNow(why)

    def _discard(self) -> None:
        self._taught.learner.discard()
        self._forming = None
