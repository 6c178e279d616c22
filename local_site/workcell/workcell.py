"""The operator's own place: what the hand moves there, and the task frames of what is demonstrated."""

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
"""Points (n, C) that were moved through, and their times (n,) [s]."""
SampleFiles = Callable[[str], Sequence[Path]]
"""The demonstrations that come with a task, by its name, where they are not in its own file."""


def no_files(_task: str) -> Sequence[Path]:
    """Where no demonstrations come with any task."""
    return ()


class Workcell(Protocol):
    """Used by the console's thread alone."""

    @property
    def frames(self) -> Sequence[TaskFrame]:
        """The task frames. Length P."""
        ...

    @property
    def view(self) -> ArmView | None:
        """The arm, where there is one."""
        ...

    def start(self, put: Callable[[Job], None], moved: OnMoved) -> None:
        """Begin.

        Args:
            put: Has something done in the console's thread.
            moved: Called in the console's thread with what the hand, or its arm, moved through.
        """
        ...

    def hand(self, point: tuple[float, ...], time_s: float, released: bool) -> None:
        """The hand is there, see `intents.Hand`.

        Raises:
            InvalidDemonstration: When that is nowhere; nothing moves.
        """
        ...

    def become(self, task: AnyTask) -> None:
        """Be the place of another task of the same robot: an arm is put where that one begins."""
        ...

    def renew(self, seed: int | None) -> None:
        """Put the arm back to ready and its receptacle elsewhere.

        Raises:
            NotNow: When there is no arm.
        """
        ...

    def align(self) -> None:
        """Turn the arm's plug, where it is, until it points along the bore. Begun when it returns.

        Raises:
            NotNow: When there is no arm.
        """
        ...

    def samples(self) -> list[Demonstration]:
        """The demonstrations that come with its task.

        Raises:
            InvalidDemonstration: When a file is missing or damaged.
        """
        ...

    def close(self) -> None:
        """End."""
        ...


class BoardWorkcell:
    """A board before a target that stands still: the hand itself makes the motion.

    Args:
        task: What is demonstrated at first.
    """

    def __init__(self, task: PointTask):
        self.view = None
        self.become(task)

    def start(self, put: Callable[[Job], None], moved: OnMoved) -> None:
        """See `Workcell.start`."""
        self._moved = moved

    def hand(self, point: tuple[float, ...], time_s: float, released: bool) -> None:
        """See `Workcell.hand`."""
        self._moved(np.array([point]), np.array([time_s]))

    def become(self, task: AnyTask) -> None:
        """See `Workcell.become`."""
        assert isinstance(task, PointTask), "a repertoire is of one robot"
        self._task, self.frames = task, still_frames(task)

    def renew(self, seed: int | None) -> None:
        """See `Workcell.renew`."""
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
    """The place that the tasks of one robot need.

    Args:
        task: The first of them.
        sample_files: The demonstrations that come with each, where they are not in its file.
        seed: Of where an arm and its receptacle are at first.
        stepped: Whether an arm's time passes with the hand's, as fast as can be, instead of by itself.
    """
    if isinstance(task, PointTask):
        return BoardWorkcell(task)
    # The physics take a second to import, which a board need not wait for.
    from farhand.local_site.workcell.live_arm import LiveArm
    from farhand.local_site.workcell.stepped_arm import SteppedArm

    return (SteppedArm if stepped else LiveArm)(task, sample_files, seed)
