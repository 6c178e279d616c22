"""Events of the exhaustive check, by name: operators, network, surroundings.

Each event changes a world. `mode_rules.py` says what an event may do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import msgspec
import numpy as np

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire.messages import Wish
from farhand.evaluation.modes.mode_surroundings import DT_S, good_model
from farhand.evaluation.modes.mode_world import ModeWorld, SimulatedOperator

STALE_S = 10.0
"""Age of a message that an outage held up: far beyond the usual, below the limit that is ever accepted."""


@dataclass(frozen=True)
class Step:
    """One event.

    Args:
        name: Name in words.
        run: Applies it; returns whether the robot accepted a command, None if none was given.
        action: Action of the command, if it is a fresh command of a site that may give it.
        operator: Number of the operator, -1 for none.
        moves_time: Whether it advances the time.
    """

    name: str
    run: Callable[[ModeWorld], bool | None]
    action: Action | None = None
    operator: int = -1
    moves_time: bool = False


def steps(n_operators: int) -> list[Step]:
    """List all events."""
    found = [*_surroundings()]
    for number in range(n_operators):
        found += _operator_steps(number)
    return found


def _operator_steps(number: int) -> list[Step]:
    found: list[Step] = []

    def add(
        name: str, do: Callable[[ModeWorld, SimulatedOperator], bool | None], action: Action | None = None
    ) -> None:
        def run(world: ModeWorld) -> bool | None:
            return do(world, world.operators[number])

        found.append(Step(f"{'ab'[number]}: {name}", run, action, number))

    # Before the others, each of which would become the last command without a change of the state.
    add("the last command again", _again)
    for action in Action:
        if action is not Action.STOP:
            add(str(action), partial(_command, action=action), action)
    for action in (Action.ARM, Action.COUPLE, Action.EXECUTE, Action.RESUME, Action.RETRACT):
        add(f"{action}, held up by an outage", partial(_stale, action=action))
    add("execute, of a plan that was never made", _unplanned)
    add("arm, of an older boot", _older_boot)
    add("stop", lambda world, operator: world.stop(operator))
    add("hand", lambda world, operator: world.hand(operator))
    add("hand, held up by an outage", lambda world, operator: world.hand(operator, age_s=STALE_S))
    add("hand, of an older coupling", lambda w, o: w.hand(o, coupling_id=o.coupling_id - 1))
    for wish in Wish:
        add(f"lease: {wish}", partial(_lease, wish=wish))
    add("goes silent", _silent)
    add("is heard again", _heard)
    return found


def _surroundings() -> list[Step]:
    def timed(name: str, do: Callable[[ModeWorld], object]) -> Step:
        def run(world: ModeWorld) -> None:
            do(world)

        return Step(name, run, moves_time=True)

    def at_once(name: str, do: Callable[[ModeWorld], object]) -> Step:
        def run(world: ModeWorld) -> None:
            do(world)

        return Step(name, run)

    return [
        timed("0.1 s", lambda world: world.run(0.1)),
        timed("1 s", lambda world: world.run(1.0)),
        timed("4 s", lambda world: world.run(4.0)),
        timed("the end of the motion", lambda world: world.run_to_the_end()),
        timed("0.1 s, of which one period began 1 s late", lambda world: world.run(DT_S, late_s=1.0)),
        at_once("the plan is ready", lambda world: world.finish_plan()),
        at_once("a good model arrives", lambda world: world.send_model(good_model())),
        at_once("a damaged model arrives", _damaged_model),
        timed("a force of 300 N for 0.1 s", partial(_force, newtons=300.0)),
        timed("a force of 500 N at once", partial(_force, newtons=500.0, duration_s=DT_S)),
        timed("the target is not seen for 0.2 s", partial(_blind, duration_s=0.2)),
        timed("the target is not seen for 1 s", partial(_blind, duration_s=1.0)),
        timed(
            "the target is not seen for 1 s and then elsewhere",
            partial(_blind, duration_s=1.0, offset_m=0.05),
        ),
        timed("the target is not seen for 6 s", partial(_blind, duration_s=6.0)),
        timed("a measurement that is not finite", _broken),
        at_once("the robot is started again", lambda world: world.restart()),
    ]


def _command(world: ModeWorld, operator: SimulatedOperator, action: Action) -> bool:
    return world.command(operator, action).accepted


def _stale(world: ModeWorld, operator: SimulatedOperator, action: Action) -> bool:
    return world.command(operator, action, echo=world.echo(STALE_S)).accepted


def _unplanned(world: ModeWorld, operator: SimulatedOperator) -> bool:
    return world.command(operator, Action.EXECUTE, plan_id=999).accepted


def _older_boot(world: ModeWorld, operator: SimulatedOperator) -> bool:
    echo = msgspec.structs.replace(world.echo(), boot="boot 0")
    return world.command(operator, Action.ARM, echo=echo).accepted


def _again(world: ModeWorld, operator: SimulatedOperator) -> bool | None:
    if operator.last is None:
        return None
    mode, n_said = world.robot.mode, len(world.said)
    reply = world.robot.on_command(operator.last)
    ran = world.robot.mode is not mode or len(world.said) > n_said
    return (reply.accepted and ran) or None


def _lease(world: ModeWorld, operator: SimulatedOperator, wish: Wish) -> None:
    world.ask_lease(operator, wish)


def _silent(_world: ModeWorld, operator: SimulatedOperator) -> None:
    operator.present = False


def _heard(_world: ModeWorld, operator: SimulatedOperator) -> None:
    operator.present = True


def _damaged_model(world: ModeWorld) -> None:
    good = good_model()
    world.send_model(msgspec.structs.replace(good, content=good.content[:-1]))


def _force(world: ModeWorld, newtons: float, duration_s: float = 0.1) -> None:
    world.plant.force_n = np.array([-newtons, 0.0])
    world.run(duration_s)
    world.plant.force_n = np.zeros(2)


def _blind(world: ModeWorld, duration_s: float, offset_m: float = 0.0) -> None:
    world.sight.seen = False
    world.run(duration_s)
    world.sight.seen, world.sight.shift_m = True, np.array([offset_m, 0.0])
    world.run(DT_S)
    world.sight.shift_m = None


def _broken(world: ModeWorld) -> None:
    world.sight.broken = True
    world.run(DT_S)
    world.sight.broken = False


def is_moving(mode: ControlMode) -> bool:
    """Decide whether anything may move the robot in a mode."""
    return mode in (ControlMode.DIRECT, ControlMode.AUTONOMOUS)
