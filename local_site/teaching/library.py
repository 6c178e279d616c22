"""What was taught of each task of a robot; teaching is about one of them at a time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from farhand.common.repertoire import TaskSet
from farhand.common.task import AnyTask
from farhand.local_site.teaching.lesson import LearnedModel, NotNow
from farhand.local_site.teaching.task_library import TaskLibrary

Array = NDArray[np.float64]


class Library:
    """It begins with the first task, and with what was taught before.

    Args:
        tasks: What the robot is to do.
        data_dir: Where demonstrations and models are kept, a folder for each task.
    """

    def __init__(self, tasks: TaskSet, data_dir: Path):
        self.tasks = tasks
        self.by_task = {task.name: TaskLibrary(task, data_dir) for task in tasks}
        """What was taught of each, by its name and in their order."""
        self._task = tasks.first

    @property
    def task(self) -> AnyTask:
        """The one that is chosen: it is taught, previewed and executed."""
        return self._task

    @property
    def chosen(self) -> TaskLibrary:
        """What was taught of it."""
        return self.by_task[self._task.name]

    @property
    def recording(self) -> bool:
        """Whether a demonstration is being made; it is one of the chosen task."""
        return self.chosen.recording

    @property
    def learned(self) -> dict[str, LearnedModel]:
        """The models by their tasks; without those of which nothing was taught."""
        return {name: each.learned for name, each in self.by_task.items() if each.learned is not None}

    def on_moved(self, points: Array, times_s: Array) -> None:
        """Learn from what the hand, or its arm, moved through, while a demonstration is being made.

        Args:
            points: Shape (n, C).
            times_s: Of the motion. Shape (n,) [s].

        Raises:
            InvalidDemonstration: When this is no motion; what came before it is learned.
        """
        if self.recording:
            for point, time_s in zip(points, times_s, strict=True):
                self.chosen.hand(point, float(time_s))

    def choose(self, name: str) -> None:
        """Have teaching be about another task from now on.

        Raises:
            NotNow: When there is no such task, or a demonstration is being recorded.
        """
        task = self.tasks.get(name)
        if task is None:
            raise NotNow(f"there is no task {name!r} here, only {', '.join(self.tasks.names)}")
        if self.recording:
            raise NotNow("a demonstration is being recorded: end or undo it first")
        self._task = task
