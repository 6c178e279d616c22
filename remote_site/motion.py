"""What moves the plant in one control period: the operator's hand, a learned model, or nothing."""

from __future__ import annotations

from enum import Enum, auto

import numpy as np

from common.task import Limits
from remote_site.coupling import Coupling
from remote_site.execution import Execution
from remote_site.perception import Perception
from remote_site.plant import Plant
from remote_site.sensing import Sensing

_STANDING_M_S = 2e-3


class Outcome(Enum):
    """What one control period came to."""

    MOVING = auto()
    STANDING = auto()
    """Nothing moves the robot, and it stands still."""
    UNDER_WAY = auto()
    """A model is executed and has not arrived."""
    ARRIVED = auto()
    """It arrived in this very period."""
    FAILED = auto()
    """A measured or computed number is not finite; the plant was braked instead."""


class Motion:
    """Moves the plant by at most one cause at a time.

    Args:
        plant: The machine.
        perception: Its surroundings, for the record of the errors.
        sensing: The newest measurements.
        limits: Of the task.
    """

    def __init__(self, plant: Plant, perception: Perception, sensing: Sensing, limits: Limits):
        self._plant, self._perception, self._sensing, self._limits = plant, perception, sensing, limits
        self.coupling: Coupling | None = None
        self.execution: Execution | None = None

    def end(self) -> None:
        """Let nothing move the robot any more; it brakes from the next period on."""
        self.coupling = self.execution = None

    def step(self, now_s: float, dt_s: float) -> Outcome:
        """Move for one control period [s]."""
        effector = self._sensing.effector
        if not np.isfinite([effector.position_m, effector.velocity_m_s]).all():
            self._plant.brake(dt_s)
            return Outcome.FAILED
        if self.execution is not None:
            return self._execute(self.execution, now_s, dt_s)
        if self.coupling is not None and self._follow(self.coupling, now_s, dt_s):
            return Outcome.MOVING
        self._plant.brake(dt_s)
        speed_m_s = float(np.linalg.norm(self._plant.read().velocity_m_s))
        return Outcome.STANDING if speed_m_s <= _STANDING_M_S else Outcome.MOVING

    def _follow(self, coupling: Coupling, now_s: float, dt_s: float) -> bool:
        """Follow the hand. False while there is no input to follow."""
        reference = coupling.reference_m(now_s)
        if reference is None:
            coupling.stop_here(self._sensing.effector.position_m)
            return False
        self._plant.follow(reference, self._limits.speed_m_s * coupling.speed_scale(now_s), dt_s)
        return True

    def _execute(self, execution: Execution, now_s: float, dt_s: float) -> Outcome:
        sensed, under_way = self._sensing, execution.arrived_after_s is None
        acceleration = execution.step(sensed.effector, sensed.frames, dt_s)
        if not np.isfinite(acceleration).all():
            self._plant.brake(dt_s)
            return Outcome.FAILED
        self._plant.accelerate(acceleration, dt_s)
        execution.measure(sensed.effector, self._perception.true_origin_m(now_s), dt_s)
        if execution.arrived_after_s is None:
            return Outcome.UNDER_WAY
        return Outcome.ARRIVED if under_way else Outcome.MOVING
