"""Operator's own workcell: the arm or board that the hand moves, and the task frames of demonstrations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.cell import Cell
from farhand.common.event_loop import Job
from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import AnyTask, PointTask
from farhand.common.wire.reasons import Code, because
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.samples import sample_strokes, still_frames
from farhand.local_site.teaching.teaching_permission import NotNow
from farhand.local_site.workcell.arm_view import ArmView
from farhand.local_site.workcell.hand_motion import HandMotion

Array = NDArray[np.float64]
OnMoved = Callable[[Array, Array], None]
"""Called with the points (n, C) of a path, and their times (n,) [s]."""
SampleFiles = Callable[[str], Sequence[Path]]
"""Returns the demonstrations that come with a task, by its name, if the task file has none."""


def no_files(_task: str) -> Sequence[Path]:
    """Return no files, for tasks without demonstrations."""
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
        """Start the workcell.

        Args:
            put: Queues a job for the console's thread.
            moved: Called in the console's thread with the path of the hand, or of its arm.
        """
        ...

    def hand(self, point: tuple[float, ...], time_s: float, released: bool) -> None:
        """Process a movement of the hand, see `intents.Hand`.

        Raises:
            InvalidDemonstration: When the point is impossible; nothing moves.
        """
        ...

    def switch_task(self, task: AnyTask) -> None:
        """Switch to another task of the same robot: an arm is moved to that task's start."""
        ...

    def reset(self, seed: int | None) -> None:
        """Put the arm back to ready, and move its receptacle, or the frames of a board, to another place.

        Raises:
            NotNow: When the frames of a board have one place only.
        """
        ...

    def lead(self, motion: HandMotion) -> None:
        """Begin to move the arm by the hand, evenly, to the goal of a motion; motions under way add up.

        Raises:
            NotNow: When there is no arm.
        """
        ...

    def samples(self) -> list[Demonstration]:
        """Return the demonstrations that come with the task.

        Raises:
            InvalidDemonstration: When a file is missing or damaged.
        """
        ...

    def close(self) -> None:
        """Close the workcell."""
        ...


class BoardWorkcell:
    """Workcell with a board and a target that does not move: the hand's own path is the demonstration.

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
        assert isinstance(task, PointTask), "all tasks are for one robot"
        self._task, self._place, self.frames = task, 0, still_frames(task)

    def reset(self, seed: int | None) -> None:
        """See `Workcell.reset`."""
        if not self._task.varies:
            raise NotNow(because(Code.NO_OTHER_PLACE))
        self._place = self._place + 1 if seed is None else seed
        self.frames = still_frames(self._task, self._place)

    def lead(self, motion: HandMotion) -> None:
        """See `Workcell.lead`."""
        raise NotNow(because(Code.NO_OWN_ARM))

    def samples(self) -> list[Demonstration]:
        """See `Workcell.samples`."""
        return sample_strokes(self._task)

    def close(self) -> None:
        """See `Workcell.close`."""


def make_workcell(
    task: AnyTask,
    cell: Cell | None = None,
    sample_files: SampleFiles = no_files,
    seed: int = 0,
    stepped: bool = False,
) -> Workcell:
    """Make the workcell that the tasks of one robot need.

    Args:
        task: First task.
        cell: The operator's arm in front of its receptacle, for the tasks of an arm.
        sample_files: Returns the demonstrations that come with each task, if the task file has none.
        seed: Seed of the first placement of an arm and its receptacle.
        stepped: True if an arm's time advances with the hand's events, as fast as possible, and not in
            real time.
    """
    if isinstance(task, PointTask):
        return BoardWorkcell(task)
    assert cell is not None, "the task of an arm is taught with one"
    # Importing the physics takes a second, and a board does not need them.
    from farhand.local_site.workcell.arm_drivers import LiveArm, SteppedArm

    return (SteppedArm if stepped else LiveArm)(task, cell, sample_files, seed)
