"""The operator's own place: what the hand moves there, and the task frames of what is demonstrated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from common.task import ArmTask, PointTask
from common.task_frame import TaskFrame
from local_site.arm_view import ArmView
from local_site.demonstration import Demonstration
from local_site.owner import Job
from local_site.samples import sample_strokes, still_frames
from local_site.taught import NotNow

Array = NDArray[np.float64]
OnMoved = Callable[[Array, Array], None]
"""Points (n, C) that were moved through, and their times (n,) [s]."""


class OwnPlace(Protocol):
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

    def renew(self, seed: int | None) -> None:
        """Put the arm back to ready and its receptacle elsewhere.

        Raises:
            NotNow: When there is no arm.
        """
        ...

    def samples(self) -> list[Demonstration]:
        """The demonstrations that come with the task.

        Raises:
            InvalidDemonstration: When a file is missing or damaged.
        """
        ...

    def close(self) -> None:
        """End."""
        ...


class Board:
    """A board before a target that stands still: the hand itself makes the motion.

    Args:
        task: The task.
    """

    def __init__(self, task: PointTask):
        self._task = task
        self.frames, self.view = still_frames(task), None

    def start(self, put: Callable[[Job], None], moved: OnMoved) -> None:
        """See `OwnPlace.start`."""
        self._moved = moved

    def hand(self, point: tuple[float, ...], time_s: float, released: bool) -> None:
        """See `OwnPlace.hand`."""
        self._moved(np.array([point]), np.array([time_s]))

    def renew(self, seed: int | None) -> None:
        """See `OwnPlace.renew`."""
        raise NotNow("there is no arm on a board that could be put elsewhere")

    def samples(self) -> list[Demonstration]:
        """See `OwnPlace.samples`."""
        return sample_strokes(self._task)

    def close(self) -> None:
        """See `OwnPlace.close`."""


def own_place(
    task: PointTask | ArmTask, sample_files: Sequence[Path] = (), seed: int = 0, stepped: bool = False
) -> OwnPlace:
    """The place that a task needs.

    Args:
        task: The task.
        sample_files: The demonstrations that come with it, where they are not in its file.
        seed: Of where an arm and its receptacle are at first.
        stepped: Whether an arm's time passes with the hand's, as fast as can be, instead of by itself.
    """
    if isinstance(task, PointTask):
        return Board(task)
    # The physics take a second to import, which a board need not wait for.
    from local_site.live_arm import LiveArm
    from local_site.stepped_arm import SteppedArm

    return (SteppedArm if stepped else LiveArm)(task, sample_files, seed)
