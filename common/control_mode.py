"""The modes of the robot and the one table of what an operator's action does in each.

The remote site owns the mode; the local site shows the mode that the remote reported and nothing else.
"""

from __future__ import annotations

from enum import StrEnum


class ControlMode(StrEnum):
    """What the robot does with the operator's input and with a learned model."""

    DISARMED = "disarmed"
    """Start-up and every restart: holds its position, accepts no motion."""
    HOLD = "hold"
    """Armed and decoupled, holds its position."""
    DIRECT = "direct"
    """Coupled: follows the operator."""
    AUTONOMOUS = "autonomous"
    """Decoupled: executes a learned model by its own MPC and its own sensing."""
    STOPPED = "stopped"
    """Latched by Stop or by a guard; left by Reset alone."""

    @property
    def coupled(self) -> bool:
        """Whether the robot follows the operator."""
        return self is ControlMode.DIRECT


class Phase(StrEnum):
    """Where an execution is; `NONE` outside of AUTONOMOUS."""

    NONE = ""
    APPROACHING = "approaching"
    ARRIVED = "arrived"
    """At the end of the motion, still tracking the task frame."""


class Action(StrEnum):
    """What an operator may ask of the robot."""

    ARM = "arm"
    DISARM = "disarm"
    COUPLE = "couple"
    CLUTCH = "clutch"
    PREVIEW = "preview"
    EXECUTE = "execute"
    ABORT = "abort"
    STOP = "stop"
    RESET = "reset"


# Each row: the action, the modes in which it is allowed, the mode that it leads to (None: stays).
_TABLE: dict[Action, tuple[frozenset[ControlMode], ControlMode | None]] = {
    Action.ARM: (frozenset({ControlMode.DISARMED}), ControlMode.HOLD),
    Action.DISARM: (frozenset(ControlMode) - {ControlMode.STOPPED}, ControlMode.DISARMED),
    Action.COUPLE: (frozenset({ControlMode.HOLD}), ControlMode.DIRECT),
    Action.CLUTCH: (frozenset({ControlMode.DIRECT}), ControlMode.HOLD),
    Action.PREVIEW: (frozenset({ControlMode.HOLD}), None),
    Action.EXECUTE: (frozenset({ControlMode.HOLD, ControlMode.DIRECT}), ControlMode.AUTONOMOUS),
    Action.ABORT: (frozenset({ControlMode.AUTONOMOUS}), ControlMode.HOLD),
    Action.STOP: (frozenset(ControlMode), ControlMode.STOPPED),
    Action.RESET: (frozenset({ControlMode.STOPPED}), ControlMode.DISARMED),
}

# Once the motion has arrived, an execution can also be left or replaced directly.
_ALSO_WHEN_ARRIVED = frozenset({Action.CLUTCH, Action.PREVIEW, Action.EXECUTE})


def mode_after(mode: ControlMode, phase: Phase, action: Action) -> ControlMode | None:
    """The mode that an allowed action leads to, or None where the table forbids it.

    Args:
        mode: The mode now.
        phase: The phase now; it matters in AUTONOMOUS only.
        action: What the operator asks for.
    """
    allowed_in, target = _TABLE[action]
    arrived = mode is ControlMode.AUTONOMOUS and phase is Phase.ARRIVED
    if mode in allowed_in or (arrived and action in _ALSO_WHEN_ARRIVED):
        return mode if target is None else target
    return None


def allowed_actions(mode: ControlMode, phase: Phase) -> frozenset[Action]:
    """Every action that the table allows now."""
    return frozenset(action for action in Action if mode_after(mode, phase, action) is not None)


def modes_allowing(action: Action) -> str:
    """The modes in which an action is allowed, in words fit for a refusal."""
    names = [mode.name for mode in ControlMode if mode in _TABLE[action][0]]
    if action in _ALSO_WHEN_ARRIVED:
        names.append("AUTONOMOUS once arrived")
    return ", ".join(names)
