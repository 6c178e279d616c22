"""Motion of the plant in one control period: by the operator's hand, a learned model, a manoeuvre, or no cause."""

from __future__ import annotations

from enum import Enum, auto
from functools import partial

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import FarhandError
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.interface.driver import call_all, halts_of
from farhand.remote_site.interface.embodiment import Embodiment, Guidance
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.motion.coupling import Coupling
from farhand.remote_site.motion.execution import Execution
from farhand.remote_site.motion.manoeuvre import Manoeuvre

_STANDING_M_S = 2e-3

Mover = Coupling | Execution | Manoeuvre


class Outcome(Enum):
    """Outcome of one control period."""

    MOVING = auto()
    STANDING = auto()
    """The robot stands still, and nothing moves it."""
    UNDER_WAY = auto()
    """A model is executed and has not arrived."""
    ARRIVED = auto()
    """It arrived in this very period."""
    ENDED = auto()
    """A manoeuvre ended in this very period."""
    FAILED = auto()
    """A measured or computed number is not finite, or the plant itself failed: see `Motion.failure`."""


class Motion:
    """Mover of the plant, by at most one cause at a time.

    Args:
        embodiment: The robot.
        sensing: The newest measurements.
    """

    def __init__(self, embodiment: Embodiment, sensing: Sensing):
        self.embodiment, self._plant, self._sensing = embodiment, embodiment.hardware.plant, sensing
        self._halts = halts_of(embodiment.hardware.plant, embodiment.hardware.perception)
        self.mover: Mover | None = None
        """The present cause of motion, also while paused."""
        self.paused = False
        self.failure: Reason | None = None
        """Reason of the last failed period's failure."""
        self.asked: NDArray[np.float64] | None = None
        """Acceleration that an execution asked of the plant in the last period. Shape (T,) [m/s^2, rad/s^2]."""
        self._interrupted = False

    @property
    def coupling(self) -> Coupling | None:
        """Operator's coupling, if it moves the robot."""
        return self.mover if isinstance(self.mover, Coupling) else None

    @property
    def execution(self) -> Execution | None:
        """Execution of a model, also while paused."""
        return self.mover if isinstance(self.mover, Execution) else None

    @property
    def executing(self) -> bool:
        """True while a model moves the robot."""
        return self.execution is not None and not self.paused

    @property
    def manoeuvre(self) -> Manoeuvre | None:
        """Present manoeuvre, also while paused."""
        return self.mover if isinstance(self.mover, Manoeuvre) else None

    def begin(self, mover: Mover) -> None:
        """Let this cause, and no other, move the robot from now on."""
        self.mover, self.paused, self._interrupted = mover, False, False

    def end(self) -> None:
        """End the present cause; the robot brakes from the next period on."""
        self.mover, self.paused = None, False

    def step(self, guidance: Guidance, now_s: float, dt_s: float, wait: bool = False) -> Outcome:
        """Move for one control period.

        Args:
            guidance: Demands of the skill on an execution.
            now_s: Present time on the robot's clock [s].
            dt_s: The period [s].
            wait: True if an execution must wait, for lack of sight.
        """
        self.asked = None
        try:
            return self._step(guidance, now_s, dt_s, wait)
        except FarhandError as error:
            return self._failed(because(Code.CANNOT_MOVE, text=str(error)), dt_s)

    def _step(self, guidance: Guidance, now_s: float, dt_s: float, wait: bool) -> Outcome:
        mover, effector = self.mover, self._sensing.effector
        if not self._sensing.is_plausible:
            return self._failed(because(Code.NOT_FINITE_MEASURED), dt_s)
        if mover is None or self.paused or (wait and isinstance(mover, Execution)):
            return self.brake(dt_s)
        if isinstance(mover, Execution):
            return self._execute(mover, guidance, now_s, dt_s)
        if isinstance(mover, Manoeuvre):
            ended = mover.step(self._plant, effector, dt_s)
            return Outcome.ENDED if ended else Outcome.MOVING
        return Outcome.MOVING if self._follow(mover, now_s, dt_s) else self.brake(dt_s)

    def brake(self, dt_s: float) -> Outcome:
        """Brake; an execution that continues later estimates its progress afresh."""
        self._interrupted = True
        self._plant.brake(dt_s)
        standing = self._plant.read().own_speed_m_s <= _STANDING_M_S
        return Outcome.STANDING if standing else Outcome.MOVING

    def halt(self, dt_s: float) -> None:
        """Brake after a fault or an error, and have the machine halt if it can. Never raises."""
        self._interrupted = True
        call_all((partial(self._plant.brake, dt_s), *self._halts))

    def _failed(self, why: Reason, dt_s: float) -> Outcome:
        self.halt(dt_s)  # before anything is logged or announced
        self.failure = why
        return Outcome.FAILED

    def _follow(self, coupling: Coupling, now_s: float, dt_s: float) -> bool:
        """Follow the hand. Return False while there is no input to follow."""
        reference = coupling.reference(now_s)
        if reference is None:
            coupling.stop_here(self._sensing.effector.controlled[0])
            return False
        allowed = self.embodiment.skill.confined(reference, self._sensing)
        if allowed is not reference:
            coupling.confine(allowed)
        self._plant.follow(
            allowed, self.embodiment.hardware.max_speed_m_s * coupling.speed_scale(now_s), dt_s
        )
        return True

    def _execute(self, execution: Execution, guidance: Guidance, now_s: float, dt_s: float) -> Outcome:
        under_way = execution.arrived_after_s is None
        if guidance.waits:
            self.brake(dt_s)
            return Outcome.MOVING
        if guidance.back is not None:
            self._interrupted = True
            execution.go_back(dt_s)
            self._plant.follow(guidance.back, guidance.back_m_s, dt_s)
            execution.measure(now_s, dt_s)
            return Outcome.MOVING
        if self._interrupted:
            execution.resume()
            self._interrupted = False
        acceleration = execution.step(dt_s)
        if not np.isfinite(acceleration).all():
            return self._failed(because(Code.NOT_FINITE_COMPUTED), dt_s)
        self._plant.accelerate(acceleration, dt_s)
        self.asked = acceleration
        execution.measure(now_s, dt_s)
        if execution.arrived_after_s is None:
            return Outcome.UNDER_WAY
        return Outcome.ARRIVED if under_way else Outcome.MOVING
