"""Search of all events in every order: the reachable states of the shipped supervisor, and its rules.

A breadth-first search over worlds that are the same up to what the rules can tell apart (mode, phase, lease,
coupling, model, plan, stop, boot, what waits, what is paused, who is heard). From every state every event is
tried, and every rule of `mode_rules.py` is checked. Mutants prove that the check can fail: the table with a
row added, removed or changed, or a guard or a check left out, all of which it must catch.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass, field

from farhand.common.mode_table import ControlMode
from farhand.evaluation.modes.mode_events import Step, steps
from farhand.evaluation.modes.mode_rules import Before, broken_rule
from farhand.evaluation.modes.mode_world import ModeWorld


@dataclass
class Exploration:
    """Result of a search.

    Args:
        n_states: Number of reached states.
        n_transitions: Number of tried events.
        depth: Depth of the last reached state.
        closed: Whether every event of every reached state was tried.
        modes: Reached modes.
        broken: First broken rule with the events that lead to it, empty for none.
    """

    n_states: int = 0
    n_transitions: int = 0
    depth: int = 0
    closed: bool = False
    modes: set[ControlMode] = field(default_factory=set)
    broken: str = ""


def state_of(world: ModeWorld) -> Hashable:
    """Return the distinguishing part of the state; two operators are interchangeable."""
    robot, lease = world.robot, world.robot.contact.lease
    motion = robot.motion
    execution, coupling, manoeuvre = motion.execution, motion.coupling, motion.manoeuvre
    now_s = world.clock.now_s()
    operators = sorted(
        (
            bool(operator.lease_id) and operator.lease_id == lease.lease_id,
            operator.present,
            coupling is not None and operator.coupling_id == coupling.coupling_id,
            operator.last is not None,
            operator.plan_id > 0,
            operator.name == lease.holder,
            operator.name == lease.asked_by,
        )
        for operator in world.operators
    )
    return (
        robot.mode,
        robot.phase,
        tuple(operators),
        coupling is not None and (coupling.waiting(now_s), coupling.lease_id == lease.lease_id),
        execution is not None and execution.arrived_after_s is not None,
        execution is not None,
        manoeuvre is not None,
        motion.paused,
        robot.recordings.recorded_s is not None,
        robot.models.newest is not None,
        world.plan_request is not None,
        min(world.n_boots, 2),
        world.speed_m_s > 1e-3,
    )


def explore(
    n_operators: int, max_depth: int | None = None, max_states: int | None = None, among: str = ""
) -> Exploration:
    """Search from a fresh robot.

    Args:
        n_operators: One or two.
        max_depth: Longest sequence of events; None: until nothing new is reached.
        max_states: Number of states after which to give up; None: never.
        among: Text with the names of the only events to try; empty: all.
    """
    found = Exploration()
    events = [step for step in steps(n_operators) if not among or step.name in among]
    first = ModeWorld(n_operators)
    waiting: deque[tuple[ModeWorld, int, tuple[str, ...]]] = deque([(first, 0, ())])
    known = {state_of(first)}
    while waiting:
        world, depth, path = waiting.popleft()
        found.depth = max(found.depth, depth)
        found.modes.add(world.robot.mode)
        if max_depth is not None and depth >= max_depth:
            continue
        state, after = state_of(world), world.copy()
        for step in events:
            rule = _try(after, step)
            found.n_transitions += 1
            if rule:
                found.broken = f"{rule}: {', '.join([*path, step.name])}"
                found.n_states = len(known)
                return found
            reached = state_of(after)
            if reached not in known:
                known.add(reached)
                waiting.append((after, depth + 1, (*path, step.name)))
            if reached != state or step.moves_time:
                # An immediate refusal has changed nothing: the next event may follow in the same world.
                after = world.copy()
        if max_states is not None and len(known) > max_states:
            break
    found.n_states, found.closed = len(known), not waiting and max_depth is None
    return found


def _try(world: ModeWorld, step: Step) -> str:
    """Apply an event. Return the rule that it broke, empty for none."""
    before = Before.of(world)
    accepted = step.run(world)
    world.said.clear()
    return broken_rule(before, step, accepted, world)
