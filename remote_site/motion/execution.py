"""One execution of a learned model: from Execute to its end, with its record."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput
from farhand.common.mode_table import Phase
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import Command, ExecutionReport, Stamp
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.motion.model_trial import StoredModel
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings, check_start

Array = NDArray[np.float64]


def start_refusal(stored: StoredModel, effector: EffectorState, frames: list[TaskFrame]) -> Reason | None:
    """Return the reason why the model cannot be executed from the robot's present state; None if it can."""
    try:
        check_start(stored.model, *effector.controlled, frames)
    except InvalidInput as error:
        return because(Code.CANNOT_START, text=error.expected)
    return None


class Execution:
    """Execution of a model on the robot's own sensing.

    Args:
        command: Execute command that began it.
        stored: Stored model.
        settings: Settings of the controller.
        embodiment: The robot.
        sensing: Newest measurements: the robot's state and the task frames.
        began: Present stamp.
    """

    def __init__(
        self,
        command: Command,
        stored: StoredModel,
        settings: ExecutorSettings,
        embodiment: Embodiment,
        sensing: Sensing,
        began: Stamp,
    ):
        self.command, self.stored, self.settings, self.began = command, stored, settings, began
        self._skill, self._sensing = embodiment.skill, sensing
        self.executor = Executor(stored.model, settings)
        self._begun = False
        self.phase = Phase.APPROACHING
        self.component = -1
        self.elapsed_s = 0.0
        self.arrived_after_s: float | None = None
        self.record = embodiment.world.new_record(stored.task)

    def step(self, dt_s: float) -> Array:
        """Compute one control period.

        Returns:
            The acceleration to apply. Shape (T,) [m/s^2, rad/s^2].
        """
        at, frames = self._sensing.effector.controlled, self._sensing.frames
        if not self._begun:
            self._begun = True
            self.executor.begin(*at, frames)
        control = self.executor.step(*at, frames)
        self.component = int(control.component)
        self.elapsed_s += dt_s
        self._update_arrival(control.arrived)
        return control.acceleration

    def _update_arrival(self, at_end_of_model: bool) -> None:
        must_seat, phase = self._skill.must_seat, self._skill.end_phase(self._sensing)
        seated = must_seat and phase is Phase.SEATED  # regardless of the model's remaining motion
        at_end = at_end_of_model or seated or self.arrived_after_s is not None
        self.phase = phase if at_end else Phase.APPROACHING
        if self.arrived_after_s is None and (seated or (at_end and not must_seat)):
            self.arrived_after_s = self.elapsed_s

    def go_back(self, dt_s: float) -> None:
        """Note that the robot retreats in this control period."""
        self.phase = Phase.RECOVERING
        self.elapsed_s += dt_s

    def go_on_with(self, settings: ExecutorSettings) -> None:
        """Continue with other settings; the progress is kept."""
        self.settings = self.executor.settings = settings

    def resume(self) -> None:
        """Continue after a standstill; estimate the progress from the robot's present state."""
        if self._begun:
            self.executor.resume(self._sensing.frames)

    def measure(self, now_s: float, dt_s: float) -> None:
        """Record one control period."""
        self.record.measure(self._sensing.effector, self.arrived_after_s is not None, now_s, dt_s)

    def report(self, now: Stamp, overruns: int) -> ExecutionReport:
        """Return the report of the execution so far."""
        return ExecutionReport(
            began=self.began,
            task=self.stored.task.name,
            model_sha256=self.stored.sha256,
            arrived_after_s=self.arrived_after_s,
            overruns=overruns,
            stamp=now,
            **self.record.fields(),
        )
