"""All that the robot watches by itself, in the order of its weight: at most one trip in a control period."""

from __future__ import annotations

from dataclasses import dataclass

from farhand.common.control_mode import ControlMode, Guard, Phase
from farhand.remote_site.interface.embodiment import Guidance
from farhand.remote_site.motion.motion import Motion
from farhand.remote_site.perception.sensing import Sensing
from farhand.remote_site.supervision.guards import ForceGuard, LinkGuard, SightGuard
from farhand.remote_site.supervision.session import OperatorSession


@dataclass(frozen=True)
class Trip:
    """A guard acts.

    Args:
        guard: Which; the table of modes says what follows.
        why: In words.
        measured: The value that was too much, if there is one.
        wanted: Whether the operator had it so: nothing is wrong.
    """

    guard: Guard
    why: str
    measured: float | None = None
    wanted: bool = False


class Guards:
    """Asks every guard that matters in the present mode.

    Args:
        sensing: The newest measurements.
        contact: How long the operator was silent.
        motion: What moves the robot, by the limits and policies of its task.
        deadline_s: A control period that comes later than this is a fault [s].
    """

    def __init__(self, sensing: Sensing, contact: OperatorSession, motion: Motion, deadline_s: float):
        self._sensing, self._contact, self._motion = sensing, contact, motion
        self._deadline_s = deadline_s
        limits = motion.embodiment.skill.task.limits  # all tasks of one robot have the same
        self._force, self._sight, self._link = ForceGuard(limits), SightGuard(sensing), LinkGuard()

    @property
    def must_wait(self) -> bool:
        """Whether an execution must not go on for want of sight."""
        return self._sight.must_wait

    def trip(
        self, mode: ControlMode, guidance: Guidance, now_s: float, dt_s: float, late_s: float
    ) -> Trip | None:
        """Return what acts now, or None.

        Args:
            mode: The present one.
            guidance: What contact asks of an execution.
            now_s: Now [s].
            dt_s: Control period [s].
            late_s: How late this period began [s].
        """
        moving = mode in (ControlMode.DIRECT, ControlMode.AUTONOMOUS)
        if moving and late_s > self._deadline_s:
            return Trip(Guard.FAULT, f"the control loop was {late_s * 1e3:.0f} ms late", late_s)
        return (
            self._force_trip(moving, dt_s)
            or self._coupling_trip(now_s)
            or self._execution_trip(mode, guidance, now_s, dt_s)
        )

    def _force_trip(self, moving: bool, dt_s: float) -> Trip | None:
        why, measured = self._force.reason(self._sensing.effector, dt_s)
        manoeuvre = self._motion.manoeuvre
        backing_off = manoeuvre is not None and manoeuvre.phase is Phase.BACKING_OFF
        return Trip(Guard.FORCE, why, measured) if why and moving and not backing_off else None

    def _coupling_trip(self, now_s: float) -> Trip | None:
        coupling = self._motion.coupling
        if coupling is None:
            self._contact.delay_changed = False  # nobody drives by the old delay
            return None
        if why := self._contact.lost_reason(coupling.lease_id, now_s):
            return Trip(Guard.COUPLING_ENDED, why)
        why = coupling.end_reason(now_s)
        return Trip(Guard.COUPLING_ENDED, why, wanted=coupling.released) if why else None

    def _execution_trip(
        self, mode: ControlMode, guidance: Guidance, now_s: float, dt_s: float
    ) -> Trip | None:
        executing = mode is ControlMode.AUTONOMOUS and self._motion.execution is not None
        if executing:
            why, measured = self._sight.reason()
            if why:
                return Trip(Guard.PERCEPTION_LOST, why, measured)
            if guidance.given_up:
                return Trip(Guard.JAMMED, guidance.given_up)
        paused = mode is ControlMode.PAUSED and self._motion.execution is not None
        blind = paused and self._sensing.unseen_s > 0.0
        task, silent_s = self._motion.embodiment.skill.task, self._contact.silent_s(now_s)
        guard, why = self._link.trip(task, silent_s, executing, blind, dt_s)
        return Trip(guard, why) if guard is not None else None
