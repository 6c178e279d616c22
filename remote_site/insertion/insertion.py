"""An insertion, executed: the model says how to move, sight and touch say where to, the guards when not to.

A plug is taken out alike: the recovery knows which.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import Limits
from farhand.remote_site.insertion.recovery import Recovery
from farhand.remote_site.insertion.touch import BACK_M_S, Arm, Touch, pose_of
from farhand.remote_site.perception.perception import SimulatedPerception
from farhand.remote_site.perception.sensing import Sensing
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings
from farhand.remote_site.supervision.guards import ForceGuard, SightGuard

Array = NDArray[np.float64]


class Insertion:
    """One execution of a learned insertion or withdrawal; call `tick` every control period, until it says why it ends.

    Args:
        arm: The machine.
        perception: Sight of the receptacle.
        model: The learned task.
        settings: How to execute it.
        limits: Of the task.
        recovery: Its way out of jams.
        preflight: Asked once, before it begins: why not to go to a receptacle with this pose, empty for nothing.
        now_s: Now [s].
        look_s: So long it stands still at first, looks at the receptacle, and the wrist's sensor is tared [s].
    """

    def __init__(
        self,
        arm: Arm,
        perception: SimulatedPerception,
        model: TPHSMM,
        settings: ExecutorSettings,
        limits: Limits,
        recovery: Recovery,
        preflight: Callable[[Array], str] = lambda _: "",
        now_s: float = 0.0,
        look_s: float = 0.5,
    ):
        self._arm, self._dt_s = arm, settings.dt_s
        self._sensing = Sensing(arm, perception, model.n_frames, 1.0 / settings.dt_s, now_s)
        self._sight, self._force = SightGuard(self._sensing), ForceGuard(limits)
        self._preflight = preflight
        self._touch = Touch(arm, perception, recovery, look_s)
        self.recovery = recovery
        self.executor = Executor(model, settings)
        self._begun = self._interrupted = False
        self._look_until_s = now_s + look_s

    @property
    def jumps(self) -> int:
        """How often the receptacle was found elsewhere."""
        return self._touch.jumps

    def tick(self, now_s: float) -> str:
        """Move for one control period; why it must not go on, empty while it may.

        Raises:
            InvalidInput: When the model cannot begin from where the arm is.
        """
        sensing, dt_s = self._sensing, self._dt_s
        sensing.update(now_s)
        reason = self._reason()
        if reason:
            self._arm.brake(dt_s)
            return reason
        waits = now_s < self._look_until_s or self._sight.must_wait
        back = self._touch.update(sensing, self._begun or not waits, now_s, dt_s)
        if waits:
            self._interrupted = True
            self._arm.brake(dt_s)
        elif back is not None:
            self._interrupted = True
            self._arm.follow(back, BACK_M_S, dt_s)
        else:
            return self._go_on(sensing.frames)
        return ""

    def _reason(self) -> str:
        if not self._sensing.effector.is_finite:
            return "a measured number is not finite"
        reason, _ = self._force.reason(self._sensing.effector, self._dt_s)
        if not reason and self._begun:
            reason, _ = self._sight.reason()
        if not reason and self.recovery.given_up:
            reason = "jammed too often"
        return reason

    def _go_on(self, frames: list[TaskFrame]) -> str:
        point, velocity = self._sensing.effector.controlled
        if not self._begun:
            refusal = self._preflight(pose_of(frames[0]))
            if refusal:
                self._arm.brake(self._dt_s)
                return f"refused: {refusal}"
            self.executor.begin(point, velocity, frames)
            self._begun = True
        elif self._interrupted:
            self.executor.resume(frames)
        self._interrupted = False
        acceleration = self.executor.step(point, velocity, frames).acceleration
        if not np.isfinite(acceleration).all():
            self._arm.brake(self._dt_s)
            return "a computed number is not finite"
        self._arm.accelerate(acceleration, self._dt_s)
        return ""
