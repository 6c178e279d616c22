"""Invariants of the modes, each with its number and its sentence, checked in every control period.

They observe the robot from outside: what arrived and when it was sent, what was answered, the mode, where the
robot is. None of them asks the checked code whether it was right.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.task import Task
from farhand.common.wire.messages import OperatorInput, Stop
from farhand.evaluation.modes.period import INPUT_SILENCE_S, AtMostOnce, DeadMan, Invariant, Period

_MOVING = (ControlMode.DIRECT, ControlMode.AUTONOMOUS)
_MANOEUVRES = (Phase.RETRACTING, Phase.GOING_TO_READY, Phase.BACKING_OFF)
_SPEED_ROUNDING_M_S = 1e-9
TTL_MAX_S = 1.0
"""Largest excess over the usual age of a message that counts [s]."""


class NoMotionWithoutLease(Invariant):
    """No motion starts without lease and arming."""

    number = "1a"
    sentence = __doc__

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        before, after = period.before, period.after
        if after.mode not in _MOVING or before.mode is after.mode:
            return ""
        if before.mode in (ControlMode.DISARMED, ControlMode.STOPPED) and not period.did(Action.ARM):
            return f"{before.mode} went to {after.mode} without being armed"
        if not any(ran.lease_id and ran.command.lease_id == ran.lease_id for ran in period.did()):
            return f"{before.mode} went to {after.mode} without a command of who holds the lease"
        return ""


class DirectEndsWithTheLease(Invariant):
    """DIRECT ends with the lease."""

    number = "1b"
    sentence = __doc__

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        after = period.after
        if after.mode is not ControlMode.DIRECT:
            return ""
        if after.coupling is None:
            return "DIRECT without a coupling"
        return "" if after.coupling[1] == after.lease_id else "DIRECT goes on after the lease has changed"


class ExecutionGoesOn(Invariant):
    """An execution once started goes on without it, by the task's lost-link policy (here: continue)."""

    number = "1c"
    sentence = __doc__

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        before, after = period.before, period.after
        if before.mode is not ControlMode.AUTONOMOUS or before.phase in _MANOEUVRES:
            return ""
        stopped = any(isinstance(each.message, Stop) for each in period.arrived)
        if after.mode is ControlMode.AUTONOMOUS or stopped or period.did():
            return ""
        return f"the execution ended in {after.mode} though nobody asked for it"


class InputsCarryAll(Invariant):
    """Every motion input carries the present boot, lease and coupling."""

    number = "2"
    sentence = __doc__

    def __init__(self) -> None:
        self._newest_s = -np.inf

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        present = period.between
        for each in period.arrived:
            message = each.message
            if (
                isinstance(message, OperatorInput)
                and present.coupling == (message.coupling_id, message.lease_id)
                and present.lease_id == message.lease_id
                and message.echo.boot == present.boot
            ):
                self._newest_s = each.arrived_s
        faster = period.after.speed_m_s > period.before.speed_m_s + _SPEED_ROUNDING_M_S
        recent = period.time_s - self._newest_s <= INPUT_SILENCE_S + 2 * period.dt_s
        if period.after.mode is ControlMode.DIRECT and faster and not recent:
            return "the robot gets faster in DIRECT without an input of this boot, lease and coupling"
        return ""


class StopDominates(Invariant):
    """Stop dominates."""

    number = "3"
    sentence = __doc__

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        boot, mode = period.after.boot, period.after.mode
        heard = any(isinstance(each.message, Stop) for each in period.arrived)
        if heard and mode is not ControlMode.STOPPED and not period.did(Action.RESET):
            return f"a stop has arrived and the robot is in {mode}"
        was_stopped = period.before.mode is ControlMode.STOPPED and period.before.boot == boot
        if was_stopped and mode is not ControlMode.STOPPED and not period.did(Action.RESET):
            return f"STOPPED went to {mode} without a Reset"
        return ""


class NothingMovesAtRest(Invariant):
    """Reset and Arm move nothing; nor does the robot get faster in any mode that holds its position."""

    number = "4"
    sentence = __doc__

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        faster = period.after.speed_m_s > period.before.speed_m_s + _SPEED_ROUNDING_M_S
        if period.between.mode in _MOVING or not faster:
            return ""
        return f"the robot gets faster in {period.between.mode}: {period.after.speed_m_s:.4f} m/s"


class NoJump(Invariant):
    """A mode change never jumps: speed and acceleration stay within the limits in every period."""

    number = "5"
    sentence = __doc__

    def __init__(self, task: Task):
        self._limits = task.limits

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        before, after = period.before, period.after
        change_m_s = float(np.linalg.norm(after.velocity_m_s - before.velocity_m_s))
        # At the edge of the workspace a wall stops the simulated plant, without an acceleration limit.
        at_wall = bool(np.any((after.velocity_m_s == 0.0) & (before.velocity_m_s != 0.0)))
        if change_m_s > self._limits.acceleration_m_s2 * period.dt_s * (1 + 1e-6) and not at_wall:
            return f"the velocity changed by {change_m_s:.4f} m/s in one period"
        moved_m = float(np.linalg.norm(after.position_m - before.position_m))
        if moved_m > self._limits.speed_m_s * period.dt_s * (1 + 1e-6):
            return f"the robot moved {moved_m * 1e3:.1f} mm in one period"
        return ""


class NoTimerMoves(Invariant):
    """No timer alone starts motion (here nothing is lost from sight and no policy retracts)."""

    number = "6"
    sentence = __doc__

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        begins = period.after.mode in _MOVING and period.between.mode is not period.after.mode
        return f"{period.between.mode} went to {period.after.mode} without a cause" if begins else ""


class NothingStaleMoves(Invariant):
    """Nothing queued moves after an outage."""

    number = "7"
    sentence = __doc__

    def __init__(self, max_age_s: float):
        self._max_age_s = max_age_s
        self._fresh_s = -np.inf

    def violation(self, period: Period) -> str:
        """See `Invariant.violation`."""
        limit_s = self._max_age_s
        if period.usual_age_s > 0.0:
            limit_s = min(limit_s, period.usual_age_s + TTL_MAX_S)
        for each in period.ran:
            if each.flight_s > limit_s + 1e-6:
                return f"a command was done that was {each.flight_s:.2f} s under way"
        for each in period.arrived:
            if isinstance(each.message, OperatorInput) and each.flight_s <= limit_s + 1e-6:
                self._fresh_s = each.arrived_s
        faster = period.after.speed_m_s > period.before.speed_m_s + _SPEED_ROUNDING_M_S
        recent = period.time_s - self._fresh_s <= INPUT_SILENCE_S + 2 * period.dt_s
        if period.after.mode is ControlMode.DIRECT and faster and not recent:
            return "the robot gets faster in DIRECT by inputs that are too old"
        return ""


NOT_HERE = {
    "8": "DISARMED and STOPPED are reachable from everywhere: tried at the end of every schedule.",
    "9": "The force limit holds in every mode: the point on the board feels no force; the arm's tests check it.",
}
"""Invariants that a single period cannot show."""


def all_invariants(task: Task, max_age_s: float) -> list[Invariant]:
    """Return new checkers for one run."""
    return [
        NoMotionWithoutLease(), DirectEndsWithTheLease(), ExecutionGoesOn(), InputsCarryAll(), StopDominates(),
        NothingMovesAtRest(), NoJump(task), NoTimerMoves(), NothingStaleMoves(max_age_s), DeadMan(task),
        AtMostOnce(),
    ]  # fmt: skip


@dataclass(frozen=True)
class Violation:
    """Invariant that did not hold.

    Args:
        invariant: Number of the invariant.
        time_s: Time of the violation [s].
        text: What happened instead.
    """

    invariant: str
    time_s: float
    text: str


def violations(invariants: Iterable[Invariant], period: Period) -> list[Violation]:
    """List all violations in one period."""
    found = ((invariant.number, invariant.violation(period)) for invariant in invariants)
    return [Violation(number, period.time_s, text) for number, text in found if text]
