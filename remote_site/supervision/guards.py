"""Guards: force, sight of the target, the link, deadlines. At most one trips in a control period.

The guards decide; the supervisor looks up in the table of modes what follows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from farhand.common.control_mode import ControlMode, Guard, Phase
from farhand.common.task import Limits, Task
from farhand.remote_site.interface.embodiment import Guidance
from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.motion.motion import Motion
from farhand.remote_site.perception.sensing import PREDICTED_S, Sensing
from farhand.remote_site.supervision.session import OperatorSession

FORCE_FOR_S = 0.05
SIGHT_PATIENCE_S = 5.0
"""Seen again within this time, an execution goes on by itself."""
SIGHT_MOVED_M = 0.020
SIGHT_TURNED_RAD = math.radians(3.0)
LINK_LOST_S = 3.0
"""Silence beyond the link's usual delay after which it is lost."""
BLIND_AND_ALONE_S = 60.0


class ForceGuard:
    """Trips when the force on the tool is too high for too long, or far too high at once.

    Args:
        limits: Of the task.
    """

    def __init__(self, limits: Limits):
        self._limits = limits
        self._above_s = 0.0

    def reason(self, effector: EffectorState, dt_s: float) -> tuple[str, float | None]:
        """Why it trips now, and the force [N]; an empty reason when it does not."""
        force_n = effector.contact_n
        if force_n is None:
            return "", None
        self._above_s = self._above_s + dt_s if force_n > self._limits.force_n else 0.0
        if force_n > self._limits.force_peak_n:
            return f"the force of {force_n:.0f} N is above {self._limits.force_peak_n:.0f} N", force_n
        if self._above_s >= FORCE_FOR_S:
            return f"the force of {force_n:.0f} N is above {self._limits.force_n:.0f} N", force_n
        return "", None


class SightGuard:
    """Lets an execution go on without sight of its target for a moment, wait for a while, then pause.

    Args:
        sensing: When the frames were seen.
    """

    def __init__(self, sensing: Sensing):
        self._sensing = sensing

    @property
    def must_wait(self) -> bool:
        """Whether an execution slows to a stop: a prediction is not good for longer."""
        return self._sensing.unseen_s > PREDICTED_S

    def reason(self) -> tuple[str, float | None]:
        """Why an execution cannot go on, and the measured value; an empty reason while it can."""
        sensed = self._sensing
        if sensed.unseen_s > SIGHT_PATIENCE_S:
            return f"perception lost: the target was not seen for {SIGHT_PATIENCE_S:.0f} s", sensed.unseen_s
        again = sensed.seen_again
        if again is None or again.gap_s <= PREDICTED_S:
            return "", None
        if again.moved_m > SIGHT_MOVED_M:
            return f"perception lost: the target came back {again.moved_m * 1e3:.0f} mm off", again.moved_m
        if again.turned_rad > SIGHT_TURNED_RAD:
            degrees = math.degrees(again.turned_rad)
            return f"perception lost: the target came back turned by {degrees:.0f} degrees", again.turned_rad
        return "", None


class LinkGuard:
    """Applies the task's policy for a lost link, once for each loss."""

    def __init__(self) -> None:
        self._acted = False
        self._blind_and_alone_s = 0.0

    def trip(
        self, task: Task, silent_s: float, executing: bool, blind: bool, dt_s: float
    ) -> tuple[Guard | None, str]:  # fmt: skip
        """What follows from the link's silence now.

        Args:
            task: The present one; its policy counts.
            silent_s: For how long nothing was heard, beyond what is usual [s].
            executing: Whether a model is executed.
            blind: Whether the execution is paused for want of sight.
            dt_s: Control period [s].
        """
        lost = silent_s > LINK_LOST_S
        self._acted = self._acted and lost
        self._blind_and_alone_s = self._blind_and_alone_s + dt_s if lost and blind else 0.0
        if task.blind_retract and self._blind_and_alone_s > BLIND_AND_ALONE_S:
            self._blind_and_alone_s = 0.0
            return Guard.LINK_LOST_RETRACT, "neither the target was seen nor the link heard for a minute"
        if not lost or self._acted or not executing or task.lost_link == "continue":
            return None, ""
        self._acted = True
        hold = task.lost_link == "hold"
        guard = Guard.LINK_LOST_HOLD if hold else Guard.LINK_LOST_RETRACT
        return (
            guard,
            f"the link is lost for {silent_s:.1f} s: this task then {'pauses' if hold else 'retracts'}",
        )


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
