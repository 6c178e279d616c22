"""What the two kinds of an operator's arm have in common: its receptacle's frame and its samples."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from common.task import ArmTask
from common.task_frame import TaskFrame
from local_site.arm_view import ArmView
from local_site.demonstration import Demonstration
from local_site.held_arm import HeldArm


class ArmPlace:
    """An arm before its receptacle, the one task frame.

    Args:
        task: What is demonstrated.
        sample_files: The demonstrations that come with the task.
        seed: Of where arm and receptacle are at first.
    """

    def __init__(self, task: ArmTask, sample_files: Sequence[Path] = (), seed: int = 0):
        self._sample_files = tuple(sample_files)
        self._arm = HeldArm(task.skill, seed)
        self.view: ArmView = self._arm.view()
        """The arm as it was last."""

    @property
    def frames(self) -> list[TaskFrame]:
        """The task frames. Length 1."""
        return [TaskFrame.at(self.view.receptacle)]

    def samples(self) -> list[Demonstration]:
        """See `OwnPlace.samples`."""
        return [Demonstration.load(file) for file in self._sample_files]
