"""Guards: force, standstill, sight of the target, silence, deadlines. At most one trips in a control period.

The guards decide; the supervisor looks up the consequence in the table of modes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.mode_table import ControlMode, Guard, Phase
from farhand.common.task import Limits
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.interface.embodiment import Guidance
from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.interface.sensing import PREDICTED_S, Sensing
from farhand.remote_site.motion.motion import Motion
from farhand.remote_site.supervision.operator_session import OperatorSession
from farhand.remote_site.supervision.operator_silence import CouplingGuard, LinkGuard

Array = NDArray[np.float64]

FORCE_FOR_S = 0.05
STILL_S = 2.0
"""Time without motion after which an execution has no effect on the machine [s]."""
STILL_M = 0.001
"""Motion that counts as none [m]."""
STILL_ASKED_M_S = 0.2
"""Speed that the accelerations of that time should have made, at least [m/s]."""
SIGHT_PATIENCE_S = 5.0
"""An execution continues if its target is seen again within this time; later it is paused [s]."""
SIGHT_MOVED_M = 0.020
SIGHT_TURNED_RAD = math.radians(3.0)


class ForceGuard:
    """Guard against a force on the tool that is too high for too long, or far too high at any time.

    Args:
        limits: Limits of the task.
    """

    def __init__(self, limits: Limits):
        self._limits = limits
        self._above_s = 0.0

    def reason(self, effector: EffectorState, dt_s: float) -> Reason | None:
        """Return the reason to trip now; None if the force is in its limits."""
        force_n = effector.contact_n
        if force_n is None:
            return None
        self._above_s = self._above_s + dt_s if force_n > self._limits.force_n else 0.0
        if force_n > self._limits.force_peak_n:
            return because(Code.FORCE, force_n=force_n, limit_n=self._limits.force_peak_n)
        if self._above_s >= FORCE_FOR_S:
            return because(Code.FORCE, force_n=force_n, limit_n=self._limits.force_n)
        return None


class StandstillGuard:
    """Guard against a machine that does not do what it is told: a drive that is off, a lost bus.

    It trips where an execution's accelerations would have made the effector fast, and it has not left its place. An
    effector that follows a virtual body, or touches something, is not judged.

    Args:
        limits: Limits of the task.
    """

    def __init__(self, limits: Limits):
        self._limits = limits
        self._place_m: Array | None = None
        self._asked_m_s: Array = np.zeros(0)
        self._still_s = 0.0

    def reason(self, asked_m_s2: Array | None, effector: EffectorState, dt_s: float) -> Reason | None:
        """Return the reason to trip now, after a period with this acceleration of an execution (None: without one)."""
        if asked_m_s2 is None or effector.setpoint is not None:
            self._place_m = None
            return None
        place_m, touches = effector.position_m, (effector.contact_n or 0.0) >= self._limits.contact_n
        if self._place_m is None or touches or math.dist(place_m, self._place_m) > STILL_M:
            self._place_m, self._still_s, self._asked_m_s = place_m, 0.0, np.zeros(effector.n_dims)
        self._still_s += dt_s
        self._asked_m_s += asked_m_s2[: effector.n_dims] * dt_s
        if self._still_s < STILL_S or math.hypot(*self._asked_m_s) < STILL_ASKED_M_S:
            return None
        return because(Code.STANDS_STILL, still_s=self._still_s)


class SightGuard:
    """Guard of sight: without it an execution continues for a moment, waits for a while, then is paused.

    Args:
        sensing: The newest measurements, with the time since the target was seen.
    """

    def __init__(self, sensing: Sensing):
        self._sensing = sensing

    @property
    def must_wait(self) -> bool:
        """True while an execution must slow to a stop, because predictions last no longer."""
        return self._sensing.unseen_s > PREDICTED_S

    def reason(self) -> Reason | None:
        """Return the reason why an execution cannot continue; None while it can."""
        sensed = self._sensing
        if sensed.unseen_s > SIGHT_PATIENCE_S:
            return because(Code.TARGET_LOST, unseen_s=sensed.unseen_s, limit_s=SIGHT_PATIENCE_S)
        again = sensed.seen_again
        if again is None or again.gap_s <= PREDICTED_S:
            return None
        if again.moved_m > SIGHT_MOVED_M:
            return because(Code.TARGET_MOVED, moved_m=again.moved_m)
        if again.turned_rad > SIGHT_TURNED_RAD:
            return because(Code.TARGET_TURNED, turned_rad=again.turned_rad)
        return None


@dataclass(frozen=True)
class Trip:
    """Action of a guard.

    Args:
        guard: Guard that tripped; the table of modes has its consequence.
        why: The reason, with the value that was too much.
        wanted: True if the operator caused the trip on purpose.
    """

    guard: Guard
    why: Reason
    wanted: bool = False


class Guards:
    """All guards that matter in the present mode.

    Args:
        sensing: The newest measurements.
        contact: Session of the operator, with its silence.
        motion: Mover of the robot; its task has the limits and the policies.
        deadline_s: A control period that comes later than this is a fault [s].
    """

    def __init__(self, sensing: Sensing, contact: OperatorSession, motion: Motion, deadline_s: float):
        self._sensing, self._contact, self._motion = sensing, contact, motion
        self._deadline_s = deadline_s
        limits = motion.embodiment.skill.task.limits  # all tasks of one robot have the same
        self._force, self._sight = ForceGuard(limits), SightGuard(sensing)
        self._standstill = StandstillGuard(limits)
        self._coupling, self._link = CouplingGuard(contact), LinkGuard()

    @property
    def must_wait(self) -> bool:
        """True while an execution must wait, for lack of sight."""
        return self._sight.must_wait

    def trip(
        self, mode: ControlMode, guidance: Guidance, now_s: float, dt_s: float, late_s: float
    ) -> Trip | None:
        """Return the guard that trips now, or None.

        Args:
            mode: Present mode.
            guidance: Guidance of the execution by contact.
            now_s: Present time on the robot's clock [s].
            dt_s: Control period [s].
            late_s: Delay of this period's beginning [s].
        """
        moving = mode in (ControlMode.DIRECT, ControlMode.AUTONOMOUS)
        if moving and late_s > self._deadline_s:
            return Trip(Guard.FAULT, because(Code.LOOP_LATE, late_s=late_s))
        asked = self._motion.asked if self._motion.executing else None
        if (still := self._standstill.reason(asked, self._sensing.effector, dt_s)) is not None:
            return Trip(Guard.FAULT, still)
        return (
            self._force_trip(moving, dt_s)
            or self._coupling_trip(now_s)
            or self._execution_trip(mode, guidance, now_s, dt_s)
        )

    def _force_trip(self, moving: bool, dt_s: float) -> Trip | None:
        why = self._force.reason(self._sensing.effector, dt_s)
        manoeuvre = self._motion.manoeuvre
        backing_off = manoeuvre is not None and manoeuvre.phase is Phase.BACKING_OFF
        return Trip(Guard.FORCE, why) if why is not None and moving and not backing_off else None

    def _coupling_trip(self, now_s: float) -> Trip | None:
        why = self._coupling.reason(self._motion.coupling, now_s)
        if why is None:
            return None
        return Trip(Guard.COUPLING_ENDED, why, wanted=why.code == Code.DRAG_ENDED)

    def _execution_trip(
        self, mode: ControlMode, guidance: Guidance, now_s: float, dt_s: float
    ) -> Trip | None:
        executing = mode is ControlMode.AUTONOMOUS and self._motion.execution is not None
        if executing:
            if (why := self._sight.reason()) is not None:
                return Trip(Guard.PERCEPTION_LOST, why)
            if guidance.given_up is not None:
                return Trip(Guard.JAMMED, guidance.given_up)
        paused = mode is ControlMode.PAUSED and self._motion.execution is not None
        blind = paused and self._sensing.unseen_s > 0.0
        task, silent_s = self._motion.embodiment.skill.task, self._contact.silent_s(now_s)
        lost = self._link.lost(task, silent_s, executing, blind, dt_s)
        return Trip(*lost) if lost is not None else None
