"""Operator's own workcell: what the hand moves there, and the task frames of demonstrations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from farhand.common.event_loop import Job
from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import AnyTask, PointTask
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.lesson import NotNow
from farhand.local_site.teaching.samples import sample_strokes, still_frames
from farhand.local_site.workcell.arm_view import ArmView

Array = NDArray[np.float64]
OnMoved = Callable[[Array, Array], None]
"""Takes the points (n, C) of a path, and their times (n,) [s]."""
SampleFiles = Callable[[str], Sequence[Path]]
"""Returns the demonstrations that come with a task, by its name, if they are not in its own file."""


def no_files(_task: str) -> Sequence[Path]:
    """Return no files: no demonstrations come with any task."""
    return ()


class Workcell(Protocol):
    """Interface of a workcell, used by the console's thread alone."""

    @property
    def frames(self) -> Sequence[TaskFrame]:
        """Task frames. Length P."""
        ...

    @property
    def view(self) -> ArmView | None:
        """Snapshot of the arm; None without one."""
        ...

    def start(self, put: Callable[[Job], None], moved: OnMoved) -> None:
        """Begin.

        Args:
            put: Has a function called in the console's thread.
            moved: Called in the console's thread with the path of the hand, or of its arm.
        """
        ...

    def hand(self, point: tuple[float, ...], time_s: float, released: bool) -> None:
        """Take the hand's place, see `intents.Hand`.

        Raises:
            InvalidDemonstration: When it is impossible; nothing moves.
        """
        ...

    def switch_task(self, task: AnyTask) -> None:
        """Switch to another task of the same robot: an arm is put where that task begins."""
        ...

    def reset(self, seed: int | None) -> None:
        """Put the arm back to ready and its receptacle elsewhere.

        Raises:
            NotNow: When there is no arm.
        """
        ...

    def align(self) -> None:
        """Begin to turn the arm's plug, where it is, until it points along the bore.

        Raises:
            NotNow: When there is no arm.
        """
        ...

    def samples(self) -> list[Demonstration]:
        """Return the demonstrations that come with its task.

        Raises:
            InvalidDemonstration: When a file is missing or damaged.
        """
        ...

    def close(self) -> None:
        """End."""
        ...


class BoardWorkcell:
    """Workcell with a board in front of a target that stands still: the hand itself makes the motion.

    Args:
        task: First task.
    """

    def __init__(self, task: PointTask):
        self.view = None
        self.switch_task(task)

    def start(self, put: Callable[[Job], None], moved: OnMoved) -> None:
        """See `Workcell.start`."""
        self._moved = moved

    def hand(self, point: tuple[float, ...], time_s: float, released: bool) -> None:
        """See `Workcell.hand`."""
        self._moved(np.array([point]), np.array([time_s]))

    def switch_task(self, task: AnyTask) -> None:
        """See `Workcell.switch_task`."""
        assert isinstance(task, PointTask), "a repertoire is of one robot"
        self._task, self.frames = task, still_frames(task)

    def reset(self, seed: int | None) -> None:
        """See `Workcell.reset`."""
        raise NotNow("there is no arm on a board that could be put elsewhere")

    def align(self) -> None:
        """See `Workcell.align`."""
        raise NotNow("there is no plug on a board that could be turned")

    def samples(self) -> list[Demonstration]:
        """See `Workcell.samples`."""
        return sample_strokes(self._task)

    def close(self) -> None:
        """See `Workcell.close`."""


def make_workcell(
    task: AnyTask, sample_files: SampleFiles = no_files, seed: int = 0, stepped: bool = False
) -> Workcell:
    """Make the workcell that the tasks of one robot need.

    Args:
        task: First task.
        sample_files: Returns the demonstrations that come with each task, if they are not in its file.
        seed: Seed of the first placement of an arm and its receptacle.
        stepped: Whether an arm's time passes with the hand's events, as fast as possible, instead of in
            real time.
    """
    if isinstance(task, PointTask):
        return BoardWorkcell(task)
    # Importing the physics takes a second, and a board does not need them.
    from farhand.local_site.workcell.arm_drivers import LiveArm, SteppedArm

    return (SteppedArm if stepped else LiveArm)(task, sample_files, seed)
