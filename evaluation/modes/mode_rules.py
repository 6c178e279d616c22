"""Rules of the modes, written independently of the shipped table: what no event may break.

Each rule has its own words from the specification of the modes; a broken one is reported by them.
"""

from __future__ import annotations

from dataclasses import dataclass

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.evaluation.modes.mode_events import Step, is_moving
from farhand.evaluation.modes.mode_world import ModeWorld

_M = ControlMode
_END = (Phase.ARRIVED, Phase.SEATED)

# Mode to which each action leads from each mode; `end` is AUTONOMOUS at the end of its motion.
_LEADS: dict[Action, dict[str, ControlMode]] = {
    Action.ARM: {"disarmed": _M.HOLD},
    Action.DISARM: dict.fromkeys(("disarmed", "hold", "direct", "autonomous", "end", "paused"), _M.DISARMED),
    Action.COUPLE: {"hold": _M.DIRECT},
    Action.CLUTCH: {"direct": _M.HOLD, "end": _M.HOLD},
    Action.PREVIEW: {"hold": _M.HOLD, "paused": _M.PAUSED, "end": _M.AUTONOMOUS},
    Action.EXECUTE: dict.fromkeys(("hold", "direct", "end"), _M.AUTONOMOUS),
    Action.PAUSE: dict.fromkeys(("autonomous", "end"), _M.PAUSED),
    Action.RESUME: {"paused": _M.AUTONOMOUS},
    Action.ABORT: dict.fromkeys(("autonomous", "end", "paused"), _M.HOLD),
    Action.RETRACT: dict.fromkeys(("hold", "paused", "end"), _M.AUTONOMOUS),
    Action.GO_TO_READY: dict.fromkeys(("hold", "paused", "end"), _M.AUTONOMOUS),
    Action.RESET: {"stopped": _M.DISARMED},
    Action.RECORD: {"direct": _M.DIRECT},
    Action.END_RECORDING: {"direct": _M.DIRECT},
    Action.SET_PACE: {mode.value: mode for mode in _M} | {"end": _M.AUTONOMOUS},
}

# Modes to which time, guards and ends of motions may lead without a command.
_BY_ITSELF = {
    _M.DISARMED: {_M.DISARMED, _M.STOPPED},
    _M.HOLD: {_M.HOLD, _M.STOPPED},
    _M.DIRECT: {_M.DIRECT, _M.HOLD, _M.AUTONOMOUS, _M.STOPPED},
    _M.AUTONOMOUS: {_M.AUTONOMOUS, _M.HOLD, _M.PAUSED, _M.STOPPED},
    _M.PAUSED: {_M.PAUSED, _M.STOPPED},
    _M.STOPPED: {_M.STOPPED},
}
# Modes to which a sudden force, a late period or a number that is not finite must lead during motion.
_MUST = {
    "a force of 300 N for 0.1 s": lambda mode, phase: mode in (_M.AUTONOMOUS, _M.HOLD),
    "a force of 500 N at once": lambda mode, phase: phase is Phase.BACKING_OFF or mode is _M.HOLD,
    "0.1 s, of which one period began 1 s late": lambda mode, phase: mode is _M.STOPPED,
}


@dataclass(frozen=True)
class Before:
    """State before an event, as far as the rules need it.

    Args:
        mode: The mode.
        phase: The phase.
        speed_m_s: Speed of the effector [m/s].
        lease_id: Lease of the holder.
        executing: True if a model was being executed, also paused.
        n_boots: Number of starts of the robot.
    """

    mode: ControlMode
    phase: Phase
    speed_m_s: float
    lease_id: str
    executing: bool
    n_boots: int

    @classmethod
    def of(cls, world: ModeWorld) -> Before:
        """Record the present state."""
        robot = world.robot
        return cls(
            robot.mode,
            robot.phase,
            world.speed_m_s,
            robot.contact.lease.lease_id,
            robot.motion.execution is not None,
            world.n_boots,
        )

    @property
    def place(self) -> str:
        """Mode, or `end`."""
        return "end" if self.mode is _M.AUTONOMOUS and self.phase in _END else self.mode.value


def broken_rule(before: Before, step: Step, accepted: bool | None, world: ModeWorld) -> str:
    """Return the rule that an event broke, in words; empty when it broke none.

    Args:
        before: World before the event.
        step: The event.
        accepted: True if the robot accepted a command, False if it refused; None if none was given.
        world: World after the event.
    """
    mode = world.robot.mode
    if world.n_boots != before.n_boots:
        return "" if mode is _M.DISARMED else "every restart is DISARMED"
    if step.name.endswith("stop"):
        return "" if mode is _M.STOPPED else "Stop from every mode"
    return (
        (_command_rules(before, step, world) if accepted else _other_rules(before, step, accepted, world))
        or _standing_rules(before, step, world)
        or _guard_rules(before, step, world)
    )


def _command_rules(before: Before, step: Step, world: ModeWorld) -> str:
    """Return the broken rule on an accepted command."""
    if step.action is None:
        return "nothing stale, of another boot, without a plan or said again counts"
    if before.lease_id != world.operators[step.operator].lease_id or not before.lease_id:
        return "no motion starts without the lease"
    leads_to = _LEADS[step.action].get(before.place)
    if leads_to is None:
        return f"{step.action} is not allowed in {before.place}"
    return "" if world.robot.mode is leads_to else f"{step.action} in {before.place} leads to {leads_to}"


def _other_rules(before: Before, step: Step, accepted: bool | None, world: ModeWorld) -> str:
    """Return the broken rule on everything but an accepted command."""
    mode = world.robot.mode
    if not step.moves_time and mode is not before.mode:
        return "only an accepted command or time changes the mode"
    if accepted is False and step.action is not None and _should_accept(before, step, world):
        return f"{step.action} is allowed in {before.place}"
    if step.moves_time and mode not in _BY_ITSELF[before.mode]:
        return f"{before.mode} does not become {mode} without a cause"
    return ""


def _should_accept(before: Before, step: Step, world: ModeWorld) -> bool:
    """Decide whether only the mode could justify a refusal: lease, age, model and plan are in order."""
    operator = world.operators[step.operator]
    holds = bool(before.lease_id) and operator.lease_id == before.lease_id
    needs_more = step.action in (Action.EXECUTE, Action.PREVIEW)
    return holds and not needs_more and before.place in _LEADS[step.action or Action.STOP]


def _standing_rules(before: Before, step: Step, world: ModeWorld) -> str:
    """Return the broken rule on what moves."""
    robot, mode = world.robot, world.robot.mode
    if (mode is _M.DIRECT) != (robot.motion.coupling is not None):
        return "DIRECT has a coupling, and only DIRECT"
    if mode is not _M.DIRECT and robot.recordings.recorded_s is not None:
        return "a recording ends with DIRECT"
    faster = world.speed_m_s > before.speed_m_s + 1e-9
    if not is_moving(before.mode) and not is_moving(mode) and faster:
        return "nothing moves the robot but DIRECT and AUTONOMOUS"
    if mode is _M.DIRECT and step.moves_time and robot.motion.coupling is not None:
        if robot.motion.coupling.lease_id != robot.contact.lease.lease_id:
            return "DIRECT ends with the lease"
        if not any(operator.present for operator in world.operators) and step.name in ("1 s", "4 s"):
            return "DIRECT ends half a second after the last that was heard"
    if mode is _M.AUTONOMOUS and robot.motion.execution is None and robot.motion.manoeuvre is None:
        return "AUTONOMOUS executes something"
    if mode is _M.PAUSED and not robot.motion.paused:
        return "PAUSED moves nothing and keeps the execution"
    return ""


def _guard_rules(before: Before, step: Step, world: ModeWorld) -> str:
    """Return the broken rule on what must happen while something moves."""
    mode, phase = world.robot.mode, world.robot.phase
    if step.name == "a measurement that is not finite" and mode is not _M.STOPPED:
        return "a number that is not finite stops the robot"
    must = _MUST.get(step.name)
    if must is not None and is_moving(before.mode) and not must(mode, phase):
        return f"{step.name}: a guard acts in {before.mode}"
    blind = step.name == "the target is not seen for 6 s"
    if blind and before.executing and mode is _M.AUTONOMOUS and world.robot.motion.execution is not None:
        return "without sight for longer than 5 s an execution is paused"
    return ""
