"""Modes of the robot, and the one table of what an operator's action does in each.

The remote site owns the mode; the local site shows the mode that the remote site reported and nothing else.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple


class ControlMode(StrEnum):
    """Mode of the robot: how it uses the operator's input and a learned model."""

    DISARMED = "disarmed"
    """Start-up and every restart: holds its position, accepts no motion."""
    HOLD = "hold"
    """Armed and decoupled, holds its position."""
    DIRECT = "direct"
    """Coupled: follows the operator."""
    AUTONOMOUS = "autonomous"
    """Decoupled: executes a learned model by its own MPC and its own sensing."""
    PAUSED = "paused"
    """Decoupled, holds its position; the execution is kept and can be resumed."""
    STOPPED = "stopped"
    """Latched by Stop or by a guard; left by Reset alone."""

    @property
    def coupled(self) -> bool:
        """True while the robot follows the operator."""
        return self is ControlMode.DIRECT


class Phase(StrEnum):
    """Phase of AUTONOMOUS; `NONE` in every other mode."""

    NONE = ""
    APPROACHING = "approaching"
    ARRIVED = "arrived"
    """At the end of the motion, still tracking the task frame."""
    SEATED = "seated"
    """The same with the tool in contact, force-limited."""
    BACKING_OFF = "backing off"
    """The force was too high: a short retreat, then HOLD."""
    RECOVERING = "recovering"
    """The tool jammed: a short retreat, then the execution continues on its own."""
    RETRACTING = "retracting"
    GOING_TO_READY = "going to ready"

    @property
    def at_end(self) -> bool:
        """True when the motion has reached its end, from where it can be left or replaced directly."""
        return self in (Phase.ARRIVED, Phase.SEATED)


class Action(StrEnum):
    """Request of the operator to the robot."""

    ARM = "arm"
    DISARM = "disarm"
    COUPLE = "couple"
    CLUTCH = "clutch"
    PREVIEW = "preview"
    EXECUTE = "execute"
    PAUSE = "pause"
    RESUME = "resume"
    ABORT = "abort"
    RETRACT = "retract"
    GO_TO_READY = "go to ready"
    SET_PACE = "set pace"
    RECORD = "record"
    """The robot records how it is driven."""
    END_RECORDING = "end recording"
    STOP = "stop"
    RESET = "reset"


class Guard(StrEnum):
    """Cause by which the robot itself ends or changes a motion, whatever the operator asks."""

    COUPLING_ENDED = "coupling ended"
    """The drag ended, input stopped, the lease was lost, the link fell silent, or its delay changed."""
    MANOEUVRE_ENDED = "manoeuvre ended"
    FORCE = "force limit"
    JAMMED = "jammed too often"
    PERCEPTION_LOST = "perception lost"
    LINK_LOST_HOLD = "link lost: hold"
    LINK_LOST_RETRACT = "link lost: retract"
    FAULT = "fault"
    """A number is not finite, or a deadline was missed by too much."""


class Row(NamedTuple):
    """Row of the table.

    Args:
        modes: Modes in which the action is allowed, or the guard acts.
        leads_to: Mode afterwards; None for no change.
        phase: Phase afterwards, unless decided elsewhere.
        at_end: Also allowed in AUTONOMOUS once its motion is at its end.
    """

    modes: frozenset[ControlMode]
    leads_to: ControlMode | None
    phase: Phase = Phase.NONE
    at_end: bool = False


Cause = Action | Guard


def _row(*modes: ControlMode, to: ControlMode | None, phase: Phase = Phase.NONE, at_end: bool = False) -> Row:
    return Row(frozenset(modes), to, phase, at_end)


_M = ControlMode
TABLE: dict[Cause, Row] = {
    Action.ARM: _row(_M.DISARMED, to=_M.HOLD),
    Action.DISARM: _row(_M.DISARMED, _M.HOLD, _M.DIRECT, _M.AUTONOMOUS, _M.PAUSED, to=_M.DISARMED),
    Action.COUPLE: _row(_M.HOLD, to=_M.DIRECT),
    Action.CLUTCH: _row(_M.DIRECT, to=_M.HOLD, at_end=True),
    Action.PREVIEW: _row(_M.HOLD, _M.PAUSED, to=None, at_end=True),
    Action.EXECUTE: _row(_M.HOLD, _M.DIRECT, to=_M.AUTONOMOUS, phase=Phase.APPROACHING, at_end=True),
    Action.PAUSE: _row(_M.AUTONOMOUS, to=_M.PAUSED),
    Action.RESUME: _row(_M.PAUSED, to=_M.AUTONOMOUS),
    Action.ABORT: _row(_M.AUTONOMOUS, _M.PAUSED, to=_M.HOLD),
    Action.RETRACT: _row(_M.HOLD, _M.PAUSED, to=_M.AUTONOMOUS, phase=Phase.RETRACTING, at_end=True),
    Action.GO_TO_READY: _row(_M.HOLD, _M.PAUSED, to=_M.AUTONOMOUS, phase=Phase.GOING_TO_READY, at_end=True),
    Action.SET_PACE: Row(frozenset(_M), None),
    Action.RECORD: _row(_M.DIRECT, to=None),
    Action.END_RECORDING: _row(_M.DIRECT, to=None),
    Action.STOP: Row(frozenset(_M), _M.STOPPED),
    Action.RESET: _row(_M.STOPPED, to=_M.DISARMED),
    Guard.COUPLING_ENDED: _row(_M.DIRECT, to=_M.HOLD),
    Guard.MANOEUVRE_ENDED: _row(_M.AUTONOMOUS, to=_M.HOLD),
    Guard.FORCE: _row(_M.DIRECT, _M.AUTONOMOUS, to=_M.AUTONOMOUS, phase=Phase.BACKING_OFF),
    Guard.JAMMED: _row(_M.AUTONOMOUS, to=_M.HOLD),
    Guard.PERCEPTION_LOST: _row(_M.AUTONOMOUS, to=_M.PAUSED),
    Guard.LINK_LOST_HOLD: _row(_M.AUTONOMOUS, to=_M.PAUSED),
    Guard.LINK_LOST_RETRACT: _row(_M.AUTONOMOUS, _M.PAUSED, to=_M.AUTONOMOUS, phase=Phase.RETRACTING),
    Guard.FAULT: Row(frozenset(_M), _M.STOPPED),
}
"""The one table: which action is allowed where, and where it leads."""


def mode_after(mode: ControlMode, phase: Phase, cause: Cause) -> ControlMode | None:
    """Return the mode that an action or a guard leads to, or None if the table has no such transition.

    Args:
        mode: Present mode.
        phase: Present phase; it matters in AUTONOMOUS only.
        cause: Action that the operator asks for, or guard that tripped.
    """
    row = TABLE[cause]
    at_end = row.at_end and mode is ControlMode.AUTONOMOUS and phase.at_end
    if mode in row.modes or at_end:
        return mode if row.leads_to is None else row.leads_to
    return None


def allowed_actions(mode: ControlMode, phase: Phase) -> frozenset[Action]:
    """Return every action that the table allows now."""
    return frozenset(action for action in Action if mode_after(mode, phase, action) is not None)


def modes_allowing(action: Action) -> str:
    """Return the modes in which an action is allowed, in words fit for a refusal."""
    row = TABLE[action]
    names = [mode.name for mode in ControlMode if mode in row.modes]
    if row.at_end:
        names.append("AUTONOMOUS at the end of its motion")
    return ", ".join(names)
