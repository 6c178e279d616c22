"""Common part of the two kinds of operator's arm: the receptacle's frame and the sample demonstrations."""

from __future__ import annotations

from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import AnyTask, ArmTask
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.workcell.arm_view import ArmView
from farhand.local_site.workcell.held_arm import HeldArm
from farhand.local_site.workcell.workcell import SampleFiles, no_files


class ArmPlace:
    """Workcell with an arm in front of its receptacle, the one task frame.

    Args:
        task: First task.
        sample_files: Returns the files of demonstrations that come with a task.
        seed: Seed of the first placement of arm and receptacle.
    """

    def __init__(self, task: ArmTask, sample_files: SampleFiles = no_files, seed: int = 0):
        self._task, self._sample_files = task, sample_files
        self._arm = HeldArm(task.skill, seed)
        self.view: ArmView = self._arm.view()
        """Newest snapshot of the arm."""

    @property
    def frames(self) -> list[TaskFrame]:
        """Task frames. Length 1."""
        return [TaskFrame.at(self.view.receptacle)]

    def switch_task(self, task: AnyTask) -> None:
        """See `Workcell.switch_task`."""
        assert isinstance(task, ArmTask), "a repertoire is of one robot"
        self._task = task
        self.reset(self.view.seed)

    def reset(self, seed: int | None) -> None:
        """See `Workcell.reset`."""
        raise NotImplementedError

    def samples(self) -> list[Demonstration]:
        """See `Workcell.samples`."""
        return [Demonstration.load(file) for file in self._sample_files(self._task.name)]
