"""One execution of a learned model: from Execute to its end, with the record of how it went."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from common.control_mode import Phase
from common.errors import InvalidInput
from common.messages import Command, ExecutionReport, Stamp
from common.task_frame import TaskFrame
from remote_site.guards import force_of
from remote_site.model_store import StoredModel
from remote_site.plant import EffectorState
from remote_site.reproduction.executor import Executor, ExecutorSettings

Array = NDArray[np.float64]

_RECORD_S = 10.0
"""Time after the arrival that the error is accumulated over [s]."""


def start_refusal(stored: StoredModel, effector: EffectorState, frames: list[TaskFrame]) -> str:
    """Why the model cannot be executed from where the robot is; empty when it can."""
    try:
        Executor(stored.model, ExecutorSettings()).begin(*effector.controlled, frames)
    except InvalidInput as error:
        return error.expected
    return ""


class TrackingRecord:
    """Distance to the true target after the arrival."""

    def __init__(self) -> None:
        self._sum_squares = 0.0
        self._n = 0
        self.tracked_s = 0.0
        self.newest_m: float | None = None

    def add(self, distance_m: float, dt_s: float) -> None:
        """Take one control period into account."""
        self.newest_m = distance_m
        if self.tracked_s < _RECORD_S:
            self._sum_squares += distance_m**2
            self._n += 1
            self.tracked_s += dt_s

    @property
    def rms_m(self) -> float | None:
        """Root mean square over the recorded time [m]."""
        return math.sqrt(self._sum_squares / self._n) if self._n else None


class Execution:
    """Runs a model on the robot's own sensing.

    Args:
        command: The Execute that began it.
        stored: The model.
        settings: Of the controller.
        effector: Where the robot is.
        frames: The task frames now.
        began: Now.
        contact_n: Force on the tool from which on it is in contact [N].
    """

    def __init__(
        self,
        command: Command,
        stored: StoredModel,
        settings: ExecutorSettings,
        effector: EffectorState,
        frames: list[TaskFrame],
        began: Stamp,
        contact_n: float,
    ):
        self.command, self.stored, self.settings, self.began = command, stored, settings, began
        self._contact_n = contact_n
        self.executor = Executor(stored.model, settings)
        self.executor.begin(*effector.controlled, frames)
        self.phase = Phase.APPROACHING
        self.component = -1
        self.elapsed_s = 0.0
        self.arrived_after_s: float | None = None
        self.record = TrackingRecord()

    def step(self, effector: EffectorState, frames: list[TaskFrame], dt_s: float) -> Array:
        """One control period.

        Returns:
            The acceleration to apply. Shape (T,) [m/s^2, rad/s^2].
        """
        control = self.executor.step(*effector.controlled, frames)
        self.component = int(control.component)
        self.elapsed_s += dt_s
        if control.arrived and self.arrived_after_s is None:
            self.arrived_after_s = self.elapsed_s
        if self.arrived_after_s is not None:
            force_n = force_of(effector)
            seated = force_n is not None and force_n >= self._contact_n
            self.phase = Phase.SEATED if seated else Phase.ARRIVED
        return control.acceleration

    def go_on_with(self, settings: ExecutorSettings) -> None:
        """Other settings from now on; the progress is kept."""
        self.settings = self.executor.settings = settings

    def resume(self, frames: list[TaskFrame]) -> None:
        """Go on after the robot stood still for a while; where it is in the motion is found anew."""
        self.executor.resume(frames)

    def measure(self, effector: EffectorState, truth_m: Array | None, dt_s: float) -> None:
        """Record the distance to where the target really is, once arrived."""
        if self.arrived_after_s is not None and truth_m is not None:
            self.record.add(float(np.linalg.norm(effector.position_m - truth_m)), dt_s)

    def report(self, now: Stamp, overruns: int) -> ExecutionReport:
        """How it went so far."""
        return ExecutionReport(
            began=self.began,
            model_sha256=self.stored.sha256,
            arrived_after_s=self.arrived_after_s,
            tracked_s=self.record.tracked_s,
            rms_error_m=self.record.rms_m,
            end_error_m=self.record.newest_m,
            overruns=overruns,
            stamp=now,
        )
