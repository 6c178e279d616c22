"""An insertion, executed: the model says how to move, sight and touch say where to, the guards when not to.

A plug is taken out alike: the recovery knows which.

What it needs of an arm is more than a `Plant` has: the torque on the tool, and that it is told where the
receptacle is. The first task frame is that of the receptacle: its origin in the mouth, z into the bore.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from common.robot.compliance import SeenReceptacle
from common.task import Limits
from common.task_frame import TaskFrame
from common.tphsmm import TPHSMM
from remote_site.guards import ForceGuard, SightGuard
from remote_site.perception import SimulatedPerception
from remote_site.plant import EffectorState, Plant
from remote_site.recovery import Felt, Recovery
from remote_site.reproduction.executor import Executor, ExecutorSettings
from remote_site.sensing import Sensing

Array = NDArray[np.float64]

_BACK_M_S = 0.08


class Arm(Plant, Protocol):
    """A plant whose points are poses of a plug's tip, and that knows of its receptacle."""

    def see(self, receptacle: SeenReceptacle | None, presses: bool = True) -> None:
        """Where the receptacle is believed to be, and whether the plug is to be pressed into it: `Servo.see`."""
        ...


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
        self._arm, self._perception, self._dt_s = arm, perception, settings.dt_s
        self._sensing = Sensing(arm, perception, model.n_frames, 1.0 / settings.dt_s, now_s)
        self._sight, self._force = SightGuard(self._sensing), ForceGuard(limits)
        self._preflight = preflight
        self.recovery = recovery
        self.executor = Executor(model, settings)
        self._begun = self._interrupted = False
        self._look_until_s = now_s + look_s
        self.jumps = 0
        """How often the receptacle was found elsewhere."""

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
        newest = self._perception.newest
        quiet = newest is not None and newest.quiet
        if newest is not None and newest.jumps > self.jumps:
            self.jumps = newest.jumps
            self.recovery.jumped()
        felt = _felt(sensing.effector)
        looks, back = now_s < self._look_until_s, None
        waits = looks or self._sight.must_wait
        if self._begun:
            back = self.recovery.update(felt, sensing.frames[0], quiet, now_s, dt_s)
        elif not waits:
            self.recovery.begin(felt.plug, sensing.frames[0])
        frames = self.recovery.corrected(sensing.frames)
        if math.isfinite(sensing.unseen_s) and not looks:  # the first estimates jump about
            velocity = np.zeros(6) if newest is None else newest.velocity
            self._arm.see(SeenReceptacle(_pose(frames[0]), velocity), self.recovery.enters)
        if waits:
            self._interrupted = True
            self._arm.brake(dt_s)
        elif back is not None:
            self._interrupted = True
            self._arm.follow(back, _BACK_M_S, dt_s)
        else:
            return self._go_on(frames)
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
            refusal = self._preflight(_pose(frames[0]))
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


def _pose(frame: TaskFrame) -> Array:
    return np.concatenate([frame.b, frame.quat_wxyz])


def _felt(effector: EffectorState) -> Felt:
    load = np.zeros(6) if effector.load is None else effector.load
    return Felt(effector.point, load[:3], TaskFrame.at(effector.point).A @ load[3:])
