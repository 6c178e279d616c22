"""Rules of `modes.md` outside its list of invariants that can be checked in every control period, too."""

from __future__ import annotations

import numpy as np

from farhand.common.control_mode import ControlMode
from farhand.common.task import Task
from farhand.common.wire.messages import OperatorInput
from farhand.evaluation.modes.period import Invariant, Period

INPUT_SILENCE_S = 0.5
_STANDING_M_S = 5e-3


class DeadMan(Invariant):
    """No input event for 0.5 s: the robot stops where it is."""

    number = "Driving"
    sentence = __doc__

    def __init__(self, task: Task):
        self._brake_s = task.limits.speed_m_s / task.limits.acceleration_m_s2
        self._newest_s = -np.inf

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        if any(isinstance(each.message, OperatorInput) for each in period.arrived):
            self._newest_s = period.time_s
        silent_s = period.time_s - self._newest_s
        if period.before.mode is not ControlMode.DIRECT or period.after.mode is not ControlMode.DIRECT:
            return ""
        late = silent_s > INPUT_SILENCE_S + self._brake_s + 2 * period.dt_s
        if late and period.after.speed_m_s > _STANDING_M_S and period.before.speed_m_s > _STANDING_M_S:
            return (
                f"{silent_s:.2f} s after the last input the robot moves at {period.after.speed_m_s:.3f} m/s"
            )
        return ""


class AtMostOnce(Invariant):
    """Commands run at most once in a boot."""

    number = "Freshness"
    sentence = __doc__

    def __init__(self) -> None:
        self._ran: set[tuple[str, str]] = set()

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        for ran in period.ran:
            key = (period.between.boot, ran.command.command_id)
            if key in self._ran:
                return f"{ran.command.action} ran twice"
            self._ran.add(key)
        return ""
