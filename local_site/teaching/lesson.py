"""Lesson of one task: its demonstrations in order, the model that they teach, its revisions, undo and relearning."""

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
"""Rough size of an arm's demonstrations [m]."""


@dataclass(frozen=True)
class LearnedModel:
    """Model with its bytes.

    Args:
        model: Learned model.
        content: Encoded model, as it is sent.
        sha256: SHA-256 of the content.
        version: Number of its revision.
        parent_sha256: SHA-256 of the previous model, empty for the first.
    """

    model: TPHSMM
    content: bytes
    sha256: str
    version: int = 1
    parent_sha256: str = ""


class Lesson:
    """Lesson of one task; it starts with the revision that was current at the end of the last process.

    Args:
        task: Task to teach.
        folder: Folder of its demonstrations and models.
    """

    def __init__(self, task: AnyTask, folder: Path):
        self.settings = LearnerSettings(max_distance_m=_lambda_m(task), min_std_m=task.learning.min_std_m)
        """Settings of the learner."""
        self._task, self._archive = task, TaskArchive(folder)
        self.faults: tuple[str, ...] = ()
        """Losses found at the start, for the operator: files that could not be read or kept."""
        self.demonstrations: tuple[StoredDemonstration, ...] = ()
        """Current demonstrations in the order in which they were learned."""
        self.before_removal: tuple[StoredDemonstration, ...] = ()
        """Demonstrations before the last change, if it was a removal."""
        self.learner = self._learner_of(())
        """Learner of these demonstrations; it learns the demonstration in progress as well."""
        self.learned: LearnedModel | None = None
        """Model of all of them."""
        self._restore()

    @property
    def revisions(self) -> tuple[Revision, ...]:
        """Newest revisions, the newest last."""
        return self._archive.revisions.kept

    @property
    def revision(self) -> int:
        """Number of the current revision, 0 before the first."""
        current = self._archive.revisions.current
        return current.number if current is not None else 0

    def end(self, demonstration: Demonstration) -> None:
        """Add the demonstration that the learner has learned while it was recorded.

        Raises:
            InvalidDemonstration: When it has no motion that can be learned; the learner is as before it.
            NotSaved: When it was added, but not written to disk.
        """
        try:
            check_units(demonstration)
            check_moves(demonstration, self.settings)
            self.learner.end()
            self._make_current(
                self.learner, (*self.demonstrations, StoredDemonstration.made_now(demonstration))
            )
        except InvalidInput:
            self.learner = self._learner_of(self.demonstrations)
            raise

    def learn(self, demonstrations: Sequence[Demonstration]) -> None:
        """Learn whole demonstrations as one revision: all of them or none.

        Raises:
            InvalidDemonstration: When one has no motion that can be learned; nothing is learned.
            NotSaved: When they were learned, but not written to disk.
        """
        made = tuple(StoredDemonstration.made_now(prepared(each, self.settings)) for each in demonstrations)
        self.relearn((*self.demonstrations, *made))

    def lacking(self, demonstrations: Sequence[Demonstration]) -> list[Demonstration]:
        """Return the given demonstrations without those that are learned already; errors as `learn`."""
        known = [each.demonstration for each in self.demonstrations]
        pairs = [(each, prepared(each, self.settings)) for each in demonstrations]
        for _, motion in pairs:
            self._check(motion)
        return [each for each, motion in pairs if not any(motion.same_motion(one) for one in known)]

    def remove(self, name: str) -> None:
        """Remove one demonstration, and learn the others again; `undo` brings it back.

        Args:
            name: Name of its file.

        Raises:
            NotSaved: When it was removed, but not on disk.
        """
        before = self.demonstrations
        try:
            self.relearn(tuple(each for each in before if each.name != name))
        finally:
            if self.demonstrations is not before:
                self.before_removal = before

    def undo(self) -> None:
        """Undo a removal, else the newest demonstration, or the newest ones together if they were learned together.

        Raises:
            NotSaved: When it was undone, but not on disk.
        """
        n_kept = self._archive.revisions.n_after_undo(tuple(each.name for each in self.demonstrations))
        self.relearn(self.before_removal or self.demonstrations[:n_kept])

    def relearn(self, demonstrations: tuple[StoredDemonstration, ...]) -> None:
        """Learn these demonstrations in place of all others.

        Raises:
            InvalidDemonstration: When one has no motion that can be learned; nothing is changed.
            NotSaved: When they were learned, but not written to disk.
        """
        self._make_current(self._learner_of(demonstrations), demonstrations)

    def start_anew(self) -> None:
        """Begin without demonstrations.

        The present ones stay as a revision until they are deleted on purpose.

        Raises:
            NotSaved: When it was done, but not on disk.
        """
        self._archive.revisions.hold()
        self.relearn(())

    def go_to(self, number: int) -> None:
        """Make another revision current: its demonstrations and model return bit for bit.

        Raises:
            InvalidDemonstration: When one of its files is missing or damaged; nothing is changed.
            NotSaved: When it is current, but not on disk.
        """
        demonstrations = self._archive.load(self._revision(number))
        self._archive.revisions.hold()
        self.relearn(demonstrations)

    def delete(self, number: int) -> None:
        """Delete a revision that is not current.

        Raises:
            NotSaved: When it was deleted, but not on disk.
        """
        self._archive.forget(number)

    def _revision(self, number: int) -> Revision:
        revision = self._archive.revisions.get(number)
        assert revision is not None, "whether a revision exists is judged before it is asked for"
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

    def _make_current(self, learner: OnlineLearner, demonstrations: tuple[StoredDemonstration, ...]) -> None:
        """Compute the model, and make it and its demonstrations current; a model that fails changes nothing."""
        parent_sha256 = self.learned.sha256 if self.learned is not None else ""
        content = encode(learner.model()) if demonstrations else b""
        model = decode(content) if content else None  # bit for bit what the robot will have
        sha256 = content_hash(content) if content else ""
        self.learner, self.demonstrations, self.before_removal = learner, demonstrations, ()
        try:
            self._archive.commit(demonstrations, sha256, content)
        finally:
            self.learned = model and LearnedModel(model, content, sha256, self.revision, parent_sha256)

    def _restore(self) -> None:
        """Learn the current revision again; set damaged demonstrations aside, and learn the others."""
        revision, self.faults = self._archive.revisions.current, self._archive.revisions.faults
        try:
            if revision is not None:
                self.relearn(self._sound(revision))
        except NotSaved as error:
            self.faults += (str(error),)
        except FarhandError as error:
            self.faults += (f"{self._task.name} begins empty: {error}",)
        for fault in self.faults:
            _log.error("%s", fault)

    def _sound(self, revision: Revision) -> tuple[StoredDemonstration, ...]:
        """Return the undamaged demonstrations of a revision; set the damaged ones aside."""
        sound = list[StoredDemonstration]()
        for name in revision.demonstrations:
            try:
                kept = self._archive.load_one(name)
                with fault_of(name, InvalidDemonstration, "a motion that can be learned"):
                    self._check(kept.demonstration)
                sound.append(kept)
            except InvalidDemonstration as error:
                self._archive.set_aside(name)
                fault = f"a demonstration of {self._task.name} is damaged and was left out: {error}"
                self.faults += (fault,)
        return tuple(sound)


def _lambda_m(task: AnyTask) -> float:
    """Return the task's own lambda, else a fraction of the size of its motions [m]."""
    extent_m = max(task.workspace_m) if isinstance(task, PointTask) else _ARM_EXTENT_M
    return task.learning.max_distance_m or LAMBDA_FRACTION * extent_m
