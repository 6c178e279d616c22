"""Tries a model that has arrived before it is confirmed: its numbers are of this world, and it can be executed.

A model may have the right form and still be of no use: covariances that cannot be inverted, durations of
centuries. It is found out here, away from the control loop, and not when the robot moves by it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput, InvalidModel
from farhand.common.log import loop_logger
from farhand.common.mailbox import Mailbox
from farhand.common.model.model_file import content_hash, decode
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import AnyTask
from farhand.common.wire.messages import ModelTransfer
from farhand.common.worker import Worker
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings

_log = loop_logger(__name__)
Array = NDArray[np.float64]

MOST_M = 100.0
MOST_S = 3600.0
LEAST_VARIANCE, MOST_VARIANCE = 1e-12, 1e4
MOST_CONDITION = 1e12
_MOST_GAIN = 1e4
_TRIED_STEPS, _TRIED_STARTS = 5, 4
_MOST_WAITING = 4

# The largest magnitude of what a field may hold.
_LIMITS: dict[str, tuple[float, str]] = {
    "means": (MOST_M, "m"),
    "start_means": (MOST_M, "m"),
    "slopes": (MOST_M, "m/s"),
    "duration_mean_s": (MOST_S, "s"),
    "elapsed_mean_s": (MOST_S, "s"),
    "duration_variance_s2": (MOST_S**2, "s^2"),
}
# The same for the fields of a way.
_WAY_LIMITS: dict[str, tuple[float, str]] = {
    "points": (MOST_M, "m"),
    "duration_s": (MOST_S, "s"),
    "gains": (_MOST_GAIN, ""),
    "time_gains": (_MOST_GAIN, "1/m"),
    "duration_gains": (_MOST_GAIN, "1/m"),
    "deviations": (MOST_M, "m"),
}


@dataclass(frozen=True)
class StoredModel:
    """A verified model.

    Args:
        sha256: Of the bytes that arrived.
        model: What they say.
        task: What it was sent for.
    """

    sha256: str
    model: TPHSMM
    task: AnyTask

    @property
    def label(self) -> str:
        """In words: its task, and the first digits of its hash."""
        return f"{self.task.name} {self.sha256[:8]}"


@dataclass(frozen=True)
class ModelTrial:
    """A model that has arrived whole and must be tried; it takes long, and any thread may do it.

    Args:
        transfer: What was said of it.
        content: Its bytes.
        task: What it was sent for.
    """

    transfer: ModelTransfer
    content: bytes
    task: AnyTask

    def run(self) -> StoredModel:
        """Decode, check and try the model.

        Raises:
            InvalidModel: When its hash, content, task, dimensions or numbers do not fit, or it cannot be executed.
        """
        sha256 = content_hash(self.content)
        if sha256 != self.transfer.sha256:
            announced = self.transfer.sha256[:8]
            raise InvalidModel("model", "sha256", f"{announced} was announced, {sha256[:8]} arrived")
        model = decode(self.content)
        _check_task(model, self.task)
        _check_numbers(model)
        _try_out(model)
        return StoredModel(sha256, model, self.task)

    def outcome(self) -> Outcome:
        """The model, or why it is refused. Never raises."""
        try:
            return self.run()
        except InvalidModel as error:
            return error
        except Exception as error:  # whatever foreign numbers lead to, they lead to it here
            _log.exception("a model could not be tried")
            return InvalidModel("model", "", f"a model that can be tried ({type(error).__name__}: {error})")


Outcome = StoredModel | InvalidModel
TryModel = Callable[[ModelTrial, Callable[[Outcome], None]], None]
"""Has a model tried, and the outcome told."""


def try_at_once(trial: ModelTrial, done: Callable[[Outcome], None]) -> None:
    """Try a model here and now."""
    done(trial.outcome())


class ModelTrials(Worker[tuple[ModelTrial, Callable[[Outcome], None]]]):
    """The worker that tries models, one after the other; of those that wait the oldest give way, unanswered."""

    def __init__(self) -> None:
        super().__init__("model trials", lambda job: try_at_once(*job), Mailbox(_MOST_WAITING))

    def submit_trial(self, trial: ModelTrial, done: Callable[[Outcome], None]) -> None:
        """Have a model tried; `done` gets the outcome from the worker's thread. Never blocks."""
        self.submit((trial, done))


def _check_task(model: TPHSMM, task: AnyTask) -> None:
    if model.manifold.oriented != task.space.oriented:
        kinds = ("positions", "poses")[:: -1 if model.manifold.oriented else 1]
        raise InvalidModel("model", "means", f"{kinds[1]}, as the task has; these are {kinds[0]}")
    if (model.n_dims, model.n_frames) != (task.space.n_dims, len(task.frame_names)):
        expected = f"{task.space.n_dims} dimensions and {len(task.frame_names)} frames"
        raise InvalidModel("model", "means", f"{expected}, got {model.n_dims} and {model.n_frames}")
    if model.frame_names != task.frame_names:
        ours, theirs = (" and ".join(map(repr, names)) for names in (task.frame_names, model.frame_names))
        raise InvalidModel(
            "model", "frame_names", f"{ours}, the frames of task {task.name!r}; it was learned in {theirs}"
        )
    if not model.terminal.any():
        raise InvalidModel("model", "terminal", "a component where a demonstration ended; end one first")


def _check_numbers(model: TPHSMM) -> None:
    """Refuse what nobody demonstrates.

    Raises:
        InvalidModel: Naming the field.
    """
    _check_sizes(model, _LIMITS)
    for way in model.ways:
        _check_sizes(way, _WAY_LIMITS, "ways.")
        _check_variances("ways.covariances", way.covariances)
    if model.max_distance_m > MOST_M:
        raise InvalidModel("model", "max_distance_m", f"at most {MOST_M:g} m, got {model.max_distance_m:.3g}")
    for name in ("covariances", "residual_covariances", "start_covariances"):
        _check_variances(name, getattr(model, name))


def _check_sizes(owner: object, limits: dict[str, tuple[float, str]], prefix: str = "") -> None:
    for name, (most, unit) in limits.items():
        largest = float(np.abs(getattr(owner, name)).max())
        if largest > most:
            raise InvalidModel(
                "model", prefix + name, f"at most {most:g} {unit}".rstrip() + f", got {largest:.3g}"
            )


def _check_variances(name: str, covariances: Array) -> None:
    variances = np.linalg.eigvalsh(covariances)
    least, most = float(variances.min()), float(variances.max())
    if least < LEAST_VARIANCE or most > MOST_VARIANCE:
        raise InvalidModel(
            "model", name, f"variances from {LEAST_VARIANCE:g} to {MOST_VARIANCE:g}, got {least:.3g} to {most:.3g}"
        )  # fmt: skip
    condition = float((variances[..., -1] / variances[..., 0]).max())
    if condition > MOST_CONDITION:
        raise InvalidModel("model", name, f"a condition of {MOST_CONDITION:g} at most, got {condition:.3g}")


def _try_out(model: TPHSMM) -> None:
    """Begin where demonstrations began, and in the middle of the motion, and execute a few periods from there.

    Raises:
        InvalidModel: When an error occurs or a number is not finite.
    """
    frames = [TaskFrame.identity(model.n_dims)] * model.n_frames
    begins = np.flatnonzero(model.initial > 0)[:_TRIED_STARTS]
    middle = np.linspace(0, model.n_components - 1, _TRIED_STARTS, dtype=int)
    executor, still = Executor(model, ExecutorSettings()), np.zeros(model.manifold.n_tangent)
    for point in (*model.means[0, begins], *model.start_means[0, begins], *model.means[0, middle]):
        try:
            executor.begin(point, still, frames)
        except InvalidInput:
            continue  # nothing is executed from behind the end
        for _ in range(_TRIED_STEPS):
            control = executor.step(point, still, frames)
            if not (np.isfinite(control.acceleration).all() and np.isfinite(control.desired).all()):
                raise InvalidModel("model", "", "a model that leads somewhere; its motion is not finite")
