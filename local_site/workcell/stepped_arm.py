"""Operator's arm whose time passes with the hand's events: as fast as possible, and reproducible."""

from __future__ import annotations

from collections.abc import Callable

from farhand.common.arm.simulation.simulation import TICK_S
from farhand.common.event_loop import Job
from farhand.common.task import ArmTask
from farhand.local_site.workcell.arm_place import ArmPlace
from farhand.local_site.workcell.held_arm import hand_pose
from farhand.local_site.workcell.workcell import OnMoved, SampleFiles, no_files

_LONGEST_S = 1.0
"""A hand that reports nothing for longer has rested, and the arm has come to rest [s]."""

_TURN_S = 5.0
"""Upper bound of the time to align a plug with the bore [s]."""


class SteppedArm(ArmPlace):
    """Workcell for a scripted operator: between two events of the hand the arm follows the first one."""

    def __init__(self, task: ArmTask, sample_files: SampleFiles = no_files, seed: int = 0):
        super().__init__(task, sample_files, seed)
        self._held_s: float | None = None
        self._n_ticks = 0

    def start(self, put: Callable[[Job], None], moved: OnMoved) -> None:
        """See `Workcell.start`."""
        self._moved = moved

    def hand(self, point: tuple[float, ...], time_s: float, released: bool) -> None:
        """See `Workcell.hand`."""
        target = hand_pose(point)
        if self._held_s is None:
            self._held_s, self._n_ticks = time_s, 0
        due = round((time_s - self._held_s) / TICK_S)
        for _ in range(min(due - self._n_ticks, round(_LONGEST_S / TICK_S))):
            self._arm.tick()
        self._n_ticks = max(due, self._n_ticks)
        if released:
            self._held_s = None
            self._arm.let_go()
        else:
            self._arm.hold(target)
        self.view = self._arm.view()
        self._moved(*self._arm.take())

    def reset(self, seed: int | None) -> None:
        """See `Workcell.reset`."""
        self._held_s = None
        self._arm.reset(self._task.skill, self._arm.seed + 1 if seed is None else seed)
        self.view = self._arm.view()

    def align(self) -> None:
        """See `Workcell.align`. Done when it returns."""
        self._held_s = None
        self._arm.align()
        for _ in range(round(_TURN_S / TICK_S)):
            if self._arm.held:
                self._arm.tick()
        self._arm.let_go()
        self.view = self._arm.view()
        self._moved(*self._arm.take())

    def close(self) -> None:
        """See `Workcell.close`."""
