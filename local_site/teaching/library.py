"""Lessons of all tasks of a robot; one task at a time is chosen for teaching."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from farhand.common.task import AnyTask, TaskSet
from farhand.common.wire.reasons import Code, because
from farhand.local_site.teaching.lesson import LearnedModel
from farhand.local_site.teaching.task_library import TaskLibrary
from farhand.local_site.teaching.teaching_permission import NotNow

Array = NDArray[np.float64]


class Library:
    """Lessons of all tasks, including those of earlier processes; the first task is chosen at the start.

    Args:
        tasks: Tasks of the robot.
        data_dir: Folder of demonstrations and models, with a folder for each task.
    """

    def __init__(self, tasks: TaskSet, data_dir: Path):
        self.tasks = tasks
        self.by_task = {task.name: TaskLibrary(task, data_dir) for task in tasks}
        """Library of each task by its name, in order."""
        self._task = tasks.first

    @property
    def task(self) -> AnyTask:
        """Chosen task: it is taught, previewed and executed."""
        return self._task

    @property
    def chosen(self) -> TaskLibrary:
        """Library of the chosen task."""
        return self.by_task[self._task.name]

    @property
    def recording(self) -> bool:
        """True while a demonstration of the chosen task is recorded."""
        return self.chosen.recording

    @property
    def learned(self) -> dict[str, LearnedModel]:
        """Models by task, without tasks that were never taught."""
        return {name: each.learned for name, each in self.by_task.items() if each.learned is not None}

    def on_moved(self, points: Array, times_s: Array) -> None:
        """Learn from the path of the hand, or of its arm, while a demonstration is recorded.

        Args:
            points: Points of the path. Shape (n, C).
            times_s: Times of the points. Shape (n,) [s].

        Raises:
            InvalidDemonstration: When a point is impossible; the points before it are learned.
        """
        if self.recording:
            for point, time_s in zip(points, times_s, strict=True):
                self.chosen.hand(point, float(time_s))

    def choose(self, name: str) -> None:
        """Choose the task that is taught from now on.

        Raises:
            NotNow: When there is no such task, or a demonstration is being recorded.
        """
        task = self.tasks.get(name)
        if task is None:
            raise NotNow(because(Code.NO_SUCH_TASK, task=name, has=tuple(self.tasks.names)))
        if self.recording:
            raise NotNow(because(Code.RECORDING_HERE))
        self._task = task
