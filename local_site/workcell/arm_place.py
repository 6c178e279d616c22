"""What the two kinds of an operator's arm have in common: its receptacle's frame and its samples."""

from __future__ import annotations

from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import AnyTask, ArmTask
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.workcell.arm_view import ArmView
from farhand.local_site.workcell.held_arm import HeldArm
from farhand.local_site.workcell.workcell import SampleFiles, no_files


class ArmPlace:
    """An arm before its receptacle, the one task frame.

    Args:
        task: What is demonstrated at first.
        sample_files: The demonstrations that come with a task.
        seed: Of where arm and receptacle are at first.
    """

    def __init__(self, task: ArmTask, sample_files: SampleFiles = no_files, seed: int = 0):
        self._task, self._sample_files = task, sample_files
        self._arm = HeldArm(task.skill, seed)
        self.view: ArmView = self._arm.view()
        """The arm as it was last."""

    @property
    def frames(self) -> list[TaskFrame]:
        """The task frames. Length 1."""
        return [TaskFrame.at(self.view.receptacle)]

    def become(self, task: AnyTask) -> None:
        """See `Workcell.become`."""
        assert isinstance(task, ArmTask), "a repertoire is of one robot"
        self._task = task
        self.renew(self.view.seed)

    def renew(self, seed: int | None) -> None:
        """See `Workcell.renew`."""
        raise NotImplementedError

    def samples(self) -> list[Demonstration]:
        """See `Workcell.samples`."""
        return [Demonstration.load(file) for file in self._sample_files(self._task.name)]
