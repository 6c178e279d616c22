"""What counts as taught: ended demonstrations in their order, the model that they make, its revisions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from farhand.common.errors import FarhandError, InvalidDemonstration, InvalidInput
from farhand.common.log import loop_logger
from farhand.common.model.model_file import content_hash, decode, encode
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import AnyTask, PointTask
from farhand.common.whole_file import fault_of
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import LAMBDA_FRACTION
from farhand.local_site.teaching.plausibility import check_moves, check_units, prepared
from farhand.local_site.teaching.revisions import Revision
from farhand.local_site.teaching.task_archive import NotSaved, StoredDemonstration, TaskArchive

_log = loop_logger(__name__)

_ARM_EXTENT_M = 0.4
"""Of what an arm demonstrates, about [m]."""


class NotNow(FarhandError):
    """The operator asked for something that is not possible at this moment; says why."""


@dataclass(frozen=True)
class LearnedModel:
    """A model with its bytes.

    Args:
        model: What was learned.
        content: As it travels.
        sha256: Of the content.
        version: The revision that it is.
        parent_sha256: The model that was there before, empty for the first.
    """

    model: TPHSMM
    content: bytes
    sha256: str
    version: int = 1
    parent_sha256: str = ""


class Lesson:
    """It begins with what counted when the last process ended.

    Args:
        task: The task.
        folder: Where its demonstrations and models are kept.
    """

    def __init__(self, task: AnyTask, folder: Path):
        self.settings = LearnerSettings(max_distance_m=_lambda_m(task), min_std_m=task.learning.min_std_m)
        """Of the learner."""
        self._task, self._archive = task, TaskArchive(folder)
        self.faults: tuple[str, ...] = ()
        """What could not be had again, or not be kept, when it began: for the operator."""
        self.demonstrations: tuple[StoredDemonstration, ...] = ()
        """In the order in which they were learned."""
        self.learner = self._learner_of(())
        """Has learned them; a demonstration that is being made is learned by it as well."""
        self.learned: LearnedModel | None = None
        """The model of all of them."""
        self._begin_with_what_counted()

    @property
    def revisions(self) -> tuple[Revision, ...]:
        """The newest ones, the newest last."""
        return self._archive.revisions.kept

    @property
    def revision(self) -> int:
        """The one that counts, 0 before the first."""
        current = self._archive.revisions.current
        return current.number if current is not None else 0

    def end(self, demonstration: Demonstration) -> None:
        """Have the demonstration count that the learner has been learning.

        Raises:
            InvalidDemonstration: When it is no motion; the learner is as before it.
            NotSaved: When it counts, but not on disk.
        """
        try:
            check_units(demonstration)
            check_moves(demonstration, self.settings)
            self.learner.end()
            self._count(self.learner, (*self.demonstrations, StoredDemonstration.made_now(demonstration)))
        except InvalidInput:
            self.learner = self._learner_of(self.demonstrations)
            raise

    def learn(self, demonstrations: Sequence[Demonstration]) -> None:
        """Learn whole demonstrations and have them count: all of them or none, as one revision.

        Raises:
            InvalidDemonstration: When one is no motion; nothing is learned.
            NotSaved: When they count, but not on disk.
        """
        made = tuple(StoredDemonstration.made_now(prepared(each, self.settings)) for each in demonstrations)
        self.become((*self.demonstrations, *made))

    def become(self, demonstrations: tuple[StoredDemonstration, ...]) -> None:
        """Learn these demonstrations, and nothing else.

        Raises:
            InvalidDemonstration: When one is no motion; nothing is changed.
            NotSaved: When they count, but not on disk.
        """
        self._count(self._learner_of(demonstrations), demonstrations)

    def start_anew(self) -> None:
        """Have nothing count; what did stays until it is deleted on purpose.

        Raises:
            NotSaved: When nothing counts, but not on disk.
        """
        self._archive.revisions.hold()
        self.become(())

    def go_to(self, number: int) -> None:
        """Have another revision count: what was taught then, bit for bit.

        Raises:
            NotNow: When there is no such revision.
            InvalidDemonstration: When a file of it is missing or damaged; nothing is changed.
            NotSaved: When it counts, but not on disk.
        """
        demonstrations = self._archive.load(self._kept(number))
        self._archive.revisions.hold()
        self.become(demonstrations)

    def delete(self, number: int) -> None:
        """Give up a revision that does not count.

        Raises:
            NotNow: When it counts, or is not there.
            NotSaved: When it was given up, but not on disk.
        """
        if self._kept(number).number == self.revision:
            raise NotNow(f"revision {number} is the one that counts: go to another one first")
        self._archive.forget(number)

    def _kept(self, number: int) -> Revision:
        revision = self._archive.revisions.get(number)
        if revision is None:
            raise NotNow(f"there is no revision {number} any more")
        return revision

    def _learner_of(self, demonstrations: tuple[StoredDemonstration, ...]) -> OnlineLearner:
        learner = OnlineLearner(self.settings, self._task.space, self._task.frame_names)
        for each in demonstrations:
            with fault_of(each.name, InvalidDemonstration, "a motion that can be learned"):
                self._learn(learner, each.demonstration)
        return learner

    def _check(self, motion: Demonstration) -> None:
        task = self._task
        if (motion.space, motion.frame_names) != (task.space, task.frame_names):
            expected = f"{'poses' if task.space.oriented else f'{task.space.n_dims} dimensions'} and the frames {', '.join(task.frame_names)} of {task.name}"
            raise InvalidDemonstration("demonstration", "position_m, quat_wxyz, frame_names", expected)
        check_units(motion)
        check_moves(motion, self.settings)

    def _learn(self, learner: OnlineLearner, motion: Demonstration) -> None:
        self._check(motion)
        learner.start()
        learner.observe_many(motion.points, motion.frames(), motion.time_s)
        learner.end()

    def _count(self, learner: OnlineLearner, demonstrations: tuple[StoredDemonstration, ...]) -> None:
        """Make the model, and have it and its demonstrations count from now on; a model that fails changes nothing."""
        parent_sha256 = self.learned.sha256 if self.learned is not None else ""
        content = encode(learner.model()) if demonstrations else b""
        model = decode(content) if content else None  # as the robot will have it, to the bit
        sha256 = content_hash(content) if content else ""
        self.learner, self.demonstrations = learner, demonstrations
        try:
            self._archive.settle(demonstrations, sha256, content)
        finally:
            self.learned = model and LearnedModel(model, content, sha256, self.revision, parent_sha256)

    def _begin_with_what_counted(self) -> None:
        """Learn what counted; what is damaged of it is set aside, and the rest counts."""
        revision, self.faults = self._archive.revisions.current, self._archive.revisions.faults
        try:
            if revision is not None:
                self.become(self._sound(revision))
        except NotSaved as error:
            self.faults += (str(error),)
        except FarhandError as error:
            self.faults += (f"{self._task.name} begins empty: {error}",)
        for fault in self.faults:
            _log.error("%s", fault)

    def _sound(self, revision: Revision) -> tuple[StoredDemonstration, ...]:
        """The demonstrations of a revision without those that are damaged, which are set aside."""
        sound = list[StoredDemonstration]()
        for name in revision.demonstrations:
            try:
                kept = self._archive.load_one(name)
                with fault_of(name, InvalidDemonstration, "a motion that can be learned"):
                    self._check(kept.demonstration)
                sound.append(kept)
            except InvalidDemonstration as error:
                self._archive.set_aside(name)
                fault = f"a demonstration of {self._task.name} is damaged and does not count: {error}"
                self.faults += (fault,)
        return tuple(sound)


def _lambda_m(task: AnyTask) -> float:
    """The task's own lambda, or one that suits the size of its motions [m]."""
    extent_m = max(task.workspace_m) if isinstance(task, PointTask) else _ARM_EXTENT_M
    return task.learning.max_distance_m or LAMBDA_FRACTION * extent_m
