"""What counts as taught: ended demonstrations in their order, the model that they make, its revisions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from farhand.common.errors import FarhandError, InvalidDemonstration
from farhand.common.log import loop_logger
from farhand.common.model.model_file import content_hash, decode, encode
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import AnyTask, PointTask
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import LAMBDA_FRACTION
from farhand.local_site.teaching.revisions import Revision
from farhand.local_site.teaching.task_archive import Kept, TaskArchive

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


class Taught:
    """It begins with what counted when the last process ended.

    Args:
        task: The task.
        folder: Where its demonstrations and models are kept.
    """

    def __init__(self, task: AnyTask, folder: Path):
        self._settings = LearnerSettings(max_distance_m=_lambda_m(task), min_std_m=task.learning.min_std_m)
        self._task, self._archive = task, TaskArchive(folder)
        self.demonstrations: tuple[Kept, ...] = ()
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

    def add(self, demonstration: Kept) -> None:
        """A demonstration counts that the learner has just learned.

        Raises:
            NotSaved: When it counts, but not on disk.
        """
        self.demonstrations = (*self.demonstrations, demonstration)
        self._count()

    def learn(self, demonstration: Kept) -> None:
        """Learn a whole demonstration, as it is, and have it count.

        Raises:
            InvalidDemonstration: When it is no motion; nothing is learned.
            NotSaved: When it counts, but not on disk.
        """
        _learn(self.learner, demonstration.demonstration)
        self.add(demonstration)

    def become(self, demonstrations: tuple[Kept, ...]) -> None:
        """Learn these demonstrations, and nothing else.

        Raises:
            NotSaved: When they count, but not on disk.
        """
        self.learner, self.demonstrations = self._learner_of(demonstrations), demonstrations
        self._count()

    def go_to(self, number: int) -> None:
        """Have another revision count: what was taught then, bit for bit.

        Raises:
            NotNow: When there is no such revision.
            InvalidDemonstration: When a file of it is missing or damaged; nothing is changed.
            NotSaved: When it counts, but not on disk.
        """
        self.become(self._archive.load(self._kept(number)))

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

    def _learner_of(self, demonstrations: tuple[Kept, ...]) -> OnlineLearner:
        learner = OnlineLearner(self._settings, self._task.space, self._task.frame_names)
        for each in demonstrations:
            _learn(learner, each.demonstration)
        return learner

    def _count(self) -> None:
        """Make the model, and have it and its demonstrations count from now on."""
        parent_sha256 = self.learned.sha256 if self.learned is not None else ""
        if not self.demonstrations:
            self.learned = None
            self._archive.settle((), "", b"")
            return
        content = encode(self.learner.model())
        model = decode(content)  # as the robot will have it, to the bit
        sha256 = content_hash(content)
        try:
            self._archive.settle(self.demonstrations, sha256, content)
        finally:
            self.learned = LearnedModel(model, content, sha256, self.revision, parent_sha256)

    def _begin_with_what_counted(self) -> None:
        revision = self._archive.revisions.current
        if revision is None:
            return
        try:
            self.become(self._archive.load(revision))
        except FarhandError as error:
            _log.error("what was taught before cannot be had again, the task begins empty: %s", error)


def _learn(learner: OnlineLearner, motion: Demonstration) -> None:
    learner.start()
    try:
        learner.observe_many(motion.points, motion.frames(), motion.time_s)
    except InvalidDemonstration:
        learner.discard()
        raise
    learner.end()


def _lambda_m(task: AnyTask) -> float:
    """The task's own lambda, or one that suits the size of its motions [m]."""
    extent_m = max(task.workspace_m) if isinstance(task, PointTask) else _ARM_EXTENT_M
    return task.learning.max_distance_m or LAMBDA_FRACTION * extent_m
