"""Trial of a received model before its confirmation: its numbers are plausible, and it can be executed.

A model may be well-formed and still be useless: covariances that cannot be inverted, durations of centuries.
The trial finds this outside of the control loop, before the robot moves by the model.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput, InvalidModel
from farhand.common.event_loop import Mailbox, Worker
from farhand.common.log import loop_logger
from farhand.common.model.model_file import content_hash, decode
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import AnyTask
from farhand.common.wire.messages import ModelTransfer
from farhand.common.wire.reason_words import sentence
from farhand.common.wire.reasons import Code, Reason, because
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
_RESTS = 9
"""Rest after a trial in durations of it: models that never end have a tenth of one processor."""

# Largest magnitude of a field's numbers.
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


class ModelRefused(InvalidModel):
    """Refusal of a tried model.

    Args:
        field: Field at fault; empty for the whole model.
        reason: Reason, for the operator.
    """

    def __init__(self, field: str, reason: Reason):
        super().__init__("model", field, sentence(reason))
        self.reason = reason


@dataclass(frozen=True)
class StoredModel:
    """Verified model.

    Args:
        sha256: SHA-256 of the bytes that arrived.
        model: Decoded model.
        task: Task that it was sent for.
    """

    sha256: str
    model: TPHSMM
    task: AnyTask

    @property
    def label(self) -> str:
        """Label for people: its task, and the first digits of its hash."""
        return f"{self.task.name} {self.sha256[:8]}"


@dataclass(frozen=True)
class ModelTrial:
    """Complete model that must be tried; the trial takes long, and any thread may run it.

    Args:
        transfer: Transfer that announced it.
        content: Bytes of the model.
        task: Task that it was sent for.
    """

    transfer: ModelTransfer
    content: bytes
    task: AnyTask

    def run(self) -> StoredModel:
        """Decode, check and try the model.

        Raises:
            ModelRefused: When its hash, task, dimensions or numbers do not fit, or it leads nowhere.
            InvalidModel: When its content is malformed, or it cannot be executed.
        """
        sha256 = content_hash(self.content)
        if sha256 != self.transfer.sha256:
            announced = self.transfer.sha256[:8]
            raise ModelRefused("sha256", because(Code.HASH_DIFFERS, announced=announced, arrived=sha256[:8]))
        model = decode(self.content)
        _check_task(model, self.task)
        _check_numbers(model)
        _try_out(model)
        return StoredModel(sha256, model, self.task)

    def outcome(self) -> Outcome:
        """Return the model, or the reason of its refusal. Never raises."""
        try:
            return self.run()
        except ModelRefused as refused:
            return refused
        except InvalidModel as error:
            return _malformed(error.field, error.expected)
        except Exception as error:  # numbers from outside may raise anything
            _log.exception("the trial of a model failed")
            return _malformed("", f"a model that can be tried ({type(error).__name__}: {error})")


Outcome = StoredModel | ModelRefused
TryModel = Callable[[ModelTrial, Callable[[Outcome], None]], None]
"""Submits a model's trial, and reports the outcome."""


def _malformed(field: str, text: str) -> ModelRefused:
    return ModelRefused(field, because(Code.MODEL_MALFORMED, field=field or "whole", text=text))


def try_at_once(trial: ModelTrial, done: Callable[[Outcome], None]) -> None:
    """Try a model in the calling thread."""
    done(trial.outcome())


class ModelTrials(Worker[tuple[ModelTrial, Callable[[Outcome], None]]]):
    """Worker that tries models in turn; when too many wait, the oldest is dropped, unanswered.

    After each it rests: on a busy machine a thread that always computes delays the control loop, because one
    interpreter runs both.
    """

    def __init__(self) -> None:
        self._over = threading.Event()
        super().__init__("model trials", self._try, Mailbox(_MOST_WAITING))

    def submit_trial(self, trial: ModelTrial, done: Callable[[Outcome], None]) -> None:
        """Have a model tried; `done` gets the outcome in the worker's thread. Never blocks."""
        self.submit((trial, done))

    def close(self) -> None:
        """End the worker."""
        self._over.set()
        super().close()

    def _try(self, job: tuple[ModelTrial, Callable[[Outcome], None]]) -> None:
        began_s = time.thread_time()
        try_at_once(*job)
        self._over.wait(_RESTS * (time.thread_time() - began_s))


def _check_task(model: TPHSMM, task: AnyTask) -> None:
    if model.manifold.oriented != task.space.oriented:
        code = Code.POSES_WANTED if task.space.oriented else Code.POSITIONS_WANTED
        raise ModelRefused("means", because(code))
    if (model.n_dims, model.n_frames) != (task.space.n_dims, len(task.frame_names)):
        wanted = because(
            Code.OTHER_SIZE, n_dims=task.space.n_dims, n_frames=len(task.frame_names), model_dims=model.n_dims,
            model_frames=model.n_frames,
        )  # fmt: skip
        raise ModelRefused("means", wanted)
    if model.frame_names != task.frame_names:
        ours, theirs = tuple(task.frame_names), tuple(model.frame_names)
        raise ModelRefused(
            "frame_names", because(Code.OTHER_FRAMES, task=task.name, ours=ours, theirs=theirs)
        )
    if not model.terminal.any():
        raise ModelRefused("terminal", because(Code.NO_END))


def _check_numbers(model: TPHSMM) -> None:
    """Refuse numbers that no demonstration produces.

    Raises:
        ModelRefused: Naming the field.
    """
    _check_sizes(model, _LIMITS)
    for way in model.ways:
        _check_sizes(way, _WAY_LIMITS, "ways.")
        _check_variances("ways.covariances", way.covariances)
    if model.max_distance_m > MOST_M:
        raise _too_large("max_distance_m", MOST_M, "m", model.max_distance_m)
    for name in ("covariances", "residual_covariances", "start_covariances"):
        _check_variances(name, getattr(model, name))


def _check_sizes(owner: object, limits: dict[str, tuple[float, str]], prefix: str = "") -> None:
    for name, (most, unit) in limits.items():
        largest = float(np.abs(getattr(owner, name)).max())
        if largest > most:
            raise _too_large(prefix + name, most, unit, largest)


def _too_large(field: str, limit: float, unit: str, largest: float) -> ModelRefused:
    return ModelRefused(field, because(Code.TOO_LARGE, largest=largest, limit=limit, field=field, unit=unit))


def _check_variances(name: str, covariances: Array) -> None:
    variances = np.linalg.eigvalsh(covariances)
    least, most = float(variances.min()), float(variances.max())
    if least < LEAST_VARIANCE or most > MOST_VARIANCE:
        wrong = because(
            Code.VARIANCE, least=least, most=most, least_allowed=LEAST_VARIANCE, most_allowed=MOST_VARIANCE, field=name
        )  # fmt: skip
        raise ModelRefused(name, wrong)
    condition = float((variances[..., -1] / variances[..., 0]).max())
    if condition > MOST_CONDITION:
        raise ModelRefused(
            name, because(Code.CONDITION, condition=condition, limit=MOST_CONDITION, field=name)
        )  # fmt: skip


def _try_out(model: TPHSMM) -> None:
    """Execute a few periods from the start of the demonstrations, and from the middle of the motion.

    Raises:
        ModelRefused: When a number is not finite.
    """
    frames = [TaskFrame.identity(model.n_dims)] * model.n_frames
    begins = np.flatnonzero(model.initial > 0)[:_TRIED_STARTS]
    middle = np.linspace(0, model.n_components - 1, _TRIED_STARTS, dtype=int)
    executor, still = Executor(model, ExecutorSettings()), np.zeros(model.manifold.n_tangent)
    for point in (*model.means[0, begins], *model.start_means[0, begins], *model.means[0, middle]):
        try:
            executor.begin(point, still, frames)
        except InvalidInput:
            continue  # no execution starts behind the end
        for _ in range(_TRIED_STEPS):
            control = executor.step(point, still, frames)
            if not (np.isfinite(control.acceleration).all() and np.isfinite(control.desired).all()):
                raise ModelRefused("", because(Code.NOT_A_MOTION))
