"""Drivers of the operator's arm: in real time by a thread, or stepped by the hand's events, reproducibly."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from functools import partial

from farhand.common.arm.cell import Cell
from farhand.common.arm.simulation.simulation import TICK_S, PhysicsFailed
from farhand.common.event_loop import Job
from farhand.common.log import loop_logger
from farhand.common.task import ArmTask
from farhand.local_site.workcell.arm_view import ArmView
from farhand.local_site.workcell.hand_motion import HandMotion
from farhand.local_site.workcell.held_arm import ArmPlace, Moved, hand_pose
from farhand.local_site.workcell.workcell import OnMoved, SampleFiles, no_files

_log = loop_logger(__name__)

_TICKS_TOLD = 3
"""The console gets a report every this many control periods."""


class LiveArm(ArmPlace):
    """Workcell that steps its arm a hundred times a second while something moves, and otherwise not at all.

    A late period delays everything after it: the arm never catches up in a burst, and recordings are in the
    arm's own time.
    """

    def __init__(self, task: ArmTask, cell: Cell, sample_files: SampleFiles = no_files, seed: int = 0):
        super().__init__(task, cell, sample_files, seed)
        self._jobs: queue.SimpleQueue[Job | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="operator's arm", daemon=True)
        self._n_untold = self._n_renewed = self._n_asked = self._n_done = 0
        self.asleep = False
        """True while nothing moves, nothing is computed and all is reported.

        Used by the console's thread alone.
        """

    def start(self, put: Callable[[Job], None], moved: OnMoved) -> None:
        """See `Workcell.start`."""
        self._put, self._moved = put, moved
        self._thread.start()

    def hand(self, point: tuple[float, ...], time_s: float, released: bool) -> None:
        """See `Workcell.hand`. Its time is the present, whatever `time_s` says."""
        target = hand_pose(point)
        self._ask(self._arm.let_go if released else partial(self._arm.hold, target))

    def reset(self, seed: int | None) -> None:
        """See `Workcell.reset`. Done when it returns."""
        done = threading.Event()
        self._ask(partial(self._renew, seed, done))
        done.wait(timeout=5.0)

    def lead(self, motion: HandMotion) -> None:
        """See `Workcell.lead`."""
        self._ask(partial(self._arm.lead, motion))

    def _ask(self, job: Job) -> None:
        self.asleep = False
        self._n_asked += 1
        self._jobs.put(job)

    def close(self) -> None:
        """See `Workcell.close`."""
        if self._thread.is_alive():
            self._jobs.put(None)
            self._thread.join(timeout=5.0)

    # The thread ---------------------------------------------------------------------------------

    def _run(self) -> None:
        due_s = time.monotonic()
        while True:
            asleep = self._arm.asleep
            try:
                job = self._jobs.get(timeout=None if asleep else max(due_s - time.monotonic(), 0.0))
            except queue.Empty:
                self._tick()
                due_s = max(due_s + TICK_S, time.monotonic() - TICK_S)
                continue
            if job is None:
                return
            job()
            self._n_done += 1
            due_s = time.monotonic() if asleep else due_s

    def _tick(self) -> None:
        try:
            self._arm.tick()
        except PhysicsFailed:
            _log.exception("the operator's arm is put back to ready")
            self._arm.reset(self._task.skill, self._arm.seed)
        self._n_untold += 1
        if self._n_untold >= _TICKS_TOLD or self._arm.asleep:
            self._tell()

    def _renew(self, seed: int | None, done: threading.Event) -> None:
        self._arm.reset(self._task.skill, self._arm.seed + 1 if seed is None else seed)
        self.view, self._n_renewed = self._arm.view(), self._n_renewed + 1
        done.set()

    def _tell(self) -> None:
        self._n_untold = 0
        arm = self._arm
        sleeps_after = self._n_done if arm.asleep else None
        self._put(partial(self._told, self._n_renewed, arm.view(), arm.take(), sleeps_after))

    def _told(self, n_renewed: int, view: ArmView, moved: Moved, sleeps_after: int | None) -> None:
        """Take a report in the console's thread; ignore one from before a reset.

        Args:
            n_renewed: Number of resets before the report.
            view: Snapshot of the arm at the report.
            moved: Path of the arm since the last report.
            sleeps_after: Number of jobs that were done when it fell asleep; None while it is awake.
        """
        self.asleep = sleeps_after == self._n_asked  # a later job wakes it
        if n_renewed == self._n_renewed:
            self.view = view
            self._moved(*moved)


_LONGEST_S = 1.0
"""A hand that reports nothing for longer has rested, and the arm has come to rest [s]."""

_LED_S = 12.0
"""Upper bound of the time to move the hand to a goal [s]."""


class SteppedArm(ArmPlace):
    """Workcell for a scripted operator: between two events of the hand the arm follows the first one."""

    def __init__(self, task: ArmTask, cell: Cell, sample_files: SampleFiles = no_files, seed: int = 0):
        super().__init__(task, cell, sample_files, seed)
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

    def lead(self, motion: HandMotion) -> None:
        """See `Workcell.lead`. Done when it returns."""
        self._held_s = None
        self._arm.lead(motion)
        for _ in range(round(_LED_S / TICK_S)):
            if self._arm.held:
                self._arm.tick()
        self._arm.let_go()
        self.view = self._arm.view()
        self._moved(*self._arm.take())

    def close(self) -> None:
        """See `Workcell.close`."""
