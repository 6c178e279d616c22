"""Intents about demonstrations at the local site: recording, undo, and return to revisions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.common.model.manifold import POSE
from farhand.common.whole_file import fault_of
from farhand.local_site.console import intents
from farhand.local_site.exchange.notices import Tell
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.goal import goal_miss
from farhand.local_site.teaching.library import Library
from farhand.local_site.teaching.task_library import TaskLibrary
from farhand.local_site.teaching.teaching_permission import NotNow
from farhand.local_site.workcell.hand_motion import align, centre
from farhand.local_site.workcell.workcell import Workcell

Array = NDArray[np.float64]

_LOST_S = 3.0
"""Time without control after which it counts as lost; equals the duration of a lease [s]."""
_STANDS_M = 0.02
"""An arm that moved by less than this has not moved [m]."""


class Teaching:
    """Executor of the operator's intents about the chosen task. Used by the console's thread alone.

    Args:
        library: Lessons of all tasks.
        place: Workcell.
        tell: Tells the operator the outcome.
    """

    def __init__(self, library: Library, place: Workcell, tell: Tell):
        self._library, self._place, self._tell = library, place, tell
        self._control_s: float | None = None
        self._recorded_until: Array | None = None
        self.asks_to_keep = False
        """True after an End away from the goal, until the demonstration is kept, discarded, or reaches the goal."""
        for each in library.by_task.values():
            for fault in each.faults:
                tell("library", fault, good=False)

    @property
    def left_over(self) -> Demonstration | None:
        """Demonstration that was being recorded when it was rolled back, or when its process ended."""
        return self._task.left_over

    def do(self, intent: intents.Teach) -> None:
        """Execute an intent.

        Raises:
            NotNow: When it is not possible at this moment.
        """
        self.asks_to_keep = False
        match intent:
            case intents.RecordDemonstration():
                self._record()
            case intents.EndDemonstration(anyway):
                self._end(anyway)
            case intents.Undo():
                self._undo()
            case intents.LoadSamples():
                self._load_samples()
            case intents.LearnFile(name, content):
                self._learn_file(name, content)
            case intents.Recover():
                self._task.recover()
                self._tell("recover", "the demonstration that was left over was learned")
            case intents.SelectRevision() | intents.StartAnew() | intents.Delete():
                self._go_back(intent)
            case intents.RemoveDemonstration(name):
                number = self._task.demonstration_names.index(name) + 1
                self._task.remove(name)
                self._tell("delete demonstration", f"demonstration {number} was deleted: Undo brings it back")
            case intents.ResetArm() | intents.Align() | intents.Centre() | intents.StepArm():
                self._move_arm(intent)

    def choose(self, name: str) -> None:
        """Choose the task that is taught, and switch the workcell to it."""
        self._library.choose(name)
        self._place.switch_task(self._library.task)
        self._recorded_until = None
        self._tell("task", f"{name} is chosen: it is taught, previewed and executed now")

    def watch(self, in_control: bool, now_s: float) -> None:
        """Roll a demonstration back when the control of the robot is lost and does not come back."""
        if in_control:
            self._control_s = now_s
        elif self._control_s is not None and now_s - self._control_s > _LOST_S:
            self._control_s = None
            self.roll_back("the control of the robot was lost")

    def roll_back(self, why: str) -> None:
        """Roll a demonstration in progress back; the model is as before it, bit for bit."""
        if self._task.recording:
            self._note_place()
            self._task.set_aside()
            self._tell("recording", f"rolled back: {why}; Recover learns it all the same")

    @property
    def miss(self) -> str:
        """Distance of the ended demonstration from the goal, in words, while the operator is asked to keep it."""
        return self._task.miss() if self.asks_to_keep else ""

    def _record(self) -> None:
        """Begin a demonstration; an arm that stands where the last one ended is put to another place first."""
        arm, ended = self._place.view, self._recorded_until
        stands = arm is not None and ended is not None and POSE.distance(arm.tip, ended, 0.0) < _STANDS_M
        if stands:
            self._place.reset(None)
        self._recorded_until = None
        self._task.record(self._place.frames)
        self._tell("record", f"recording a demonstration{' from a new place' if stands else ''}")

    def _note_place(self) -> None:
        """Note where a recording has moved the arm to."""
        arm, moved = self._place.view, self._task.current
        if arm is not None and moved and POSE.distance(arm.tip, np.asarray(moved[0]), 0.0) > _STANDS_M:
            self._recorded_until = arm.tip

    def _end(self, anyway: bool) -> None:
        """Keep the demonstration; ask first if it misses the goal."""
        if not anyway and (miss := self._task.miss()):
            self.asks_to_keep = True
            # A question, not a refusal: the page asks it as long as `miss` says so.
            self._tell("end", f"it ends {miss}: go on, discard it, or keep it anyway")
            return
        self._note_place()
        learned = self._task.end()
        n = len(self._task.demonstrations)
        self._tell("end", f"learned demonstration {n}: {learned.model.n_components} components")

    def _undo(self) -> None:
        recording, before = self._task.recording, len(self._task.demonstrations)
        self._note_place()
        self._task.undo()
        n = before - len(self._task.demonstrations)
        undone = "the last demonstration was undone" if n == 1 else f"the last {n} demonstrations were undone"
        if n < 0:
            undone = "the deleted demonstration is back"
        self._tell("undo", "the recording under way was discarded" if recording else undone)

    @property
    def _task(self) -> TaskLibrary:
        return self._library.chosen

    def _load_samples(self) -> None:
        samples = self._place.samples()
        if not samples:
            raise NotNow("no demonstrations come with this task")
        if not (samples := self._task.lacking(samples)):
            raise NotNow("they are learned already: nothing was added")
        self._task.learn(samples)
        self._tell("samples", f"{len(samples)} samples were learned: Undo takes all of them back")

    def _learn_file(self, name: str, content: bytes) -> None:
        """Learn the demonstration in a file; one that misses the goal is learned, and named as such."""
        if not content:
            raise NotNow(f"{name} is empty, or too large to be uploaded: nothing was added")
        with fault_of(name, InvalidDemonstration, "a motion that can be learned"):
            made = Demonstration.decode(content, name)
            lacking = self._task.lacking([made])
        if not lacking:
            raise NotNow(f"{name} is learned already: nothing was added")
        self._task.learn([replace(made, source=made.source or name)])
        miss = goal_miss(self._library.task, made.frames_at(-1)[-1].to_local(made.points[-1]))
        ends = f"; it ends {miss}: Undo takes it back" if miss else ""
        self._tell("upload", f"learned {name} as demonstration {len(self._task.demonstrations)}{ends}")

    def _move_arm(self, intent: intents.ResetArm | intents.MoveHand) -> None:
        match intent:
            case intents.ResetArm(seed):
                self._place.reset(seed)
                self._recorded_until = None
                arm = self._place.view is not None
                what = (
                    "your arm is back at ready, and its receptacle" if arm else "the frames on your board are"
                )
                self._tell("renew", f"{what} elsewhere")
            case intents.Align():
                self._place.lead(align)
                self._tell("align", "your plug turns until it points along the bore")
            case intents.Centre():
                self._place.lead(centre)
                self._tell("centre", "your plug moves onto the axis of the bore, and turns along it")
            case intents.StepArm(nudge):
                self._place.lead(nudge)

    def _go_back(self, intent: intents.SelectRevision | intents.StartAnew | intents.Delete) -> None:
        match intent:
            case intents.SelectRevision(number):
                self._task.go_to(number)
                self._tell("library", f"revision {number} is current now")
            case intents.StartAnew():
                self._task.start_anew()
                self._tell("library", "started without demonstrations; the earlier ones stay as a revision")
            case intents.Delete(number):
                self._task.delete(number)
                self._tell("library", f"revision {number} was deleted")
