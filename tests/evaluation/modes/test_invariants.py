"""Each invariant finds the fault that it is for, and nothing in a sound period."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from farhand.common.configuration import load_toml
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.task import PointTask
from farhand.common.wire.messages import Command, OperatorInput, Stamp, Stop
from farhand.evaluation.modes.invariants import all_invariants, violations
from farhand.evaluation.modes.period import Arrived, Period, Ran, RobotSnapshot

TASK = load_toml(Path(__file__).parents[3] / "deploy" / "tasks" / "planar.toml", PointTask)
DT_S = 0.05
STILL = RobotSnapshot(
    boot="boot", mode=ControlMode.HOLD, phase=Phase.NONE, lease_id="lease", coupling=None,
    position_m=np.array([0.5, 0.5]), velocity_m_s=np.zeros(2),
)  # fmt: skip
DIRECT = replace(STILL, mode=ControlMode.DIRECT, coupling=(1, "lease"))
AUTONOMOUS = replace(STILL, mode=ControlMode.AUTONOMOUS, phase=Phase.APPROACHING)
STOPPED, DISARMED = (replace(STILL, mode=mode) for mode in (ControlMode.STOPPED, ControlMode.DISARMED))


def moving(snapshot: RobotSnapshot, speed_m_s: float = 0.1) -> RobotSnapshot:
    return replace(snapshot, velocity_m_s=np.array([speed_m_s, 0.0]))


def command(action: Action, lease_id: str = "lease") -> Command:
    return Command(command_id=f"{action}", session="s", lease_id=lease_id, action=action, echo=None)


def ran(action: Action, flight_s: float = 0.3, holder: str = "lease", lease_id: str = "lease") -> Ran:
    return Ran(command(action, lease_id), flight_s, holder)


def hand(coupling_id: int = 1, boot: str = "boot", flight_s: float = 0.3) -> Arrived:
    message = OperatorInput(
        seq=1, echo=Stamp(boot, 1), lease_id="lease", coupling_id=coupling_id, position_m=(0.1, 0.1)
    )
    return Arrived(message, 100.0 - flight_s, 100.0)


def stop() -> Arrived:
    return Arrived(Stop(stop_id="stop", site_name="ann"), 99.0, 100.0)


def period(
    before: RobotSnapshot, after: RobotSnapshot, *arrived: Arrived, between: RobotSnapshot | None = None,
    did: tuple[Ran, ...] = (), time_s: float = 100.0,
) -> Period:  # fmt: skip
    return Period(time_s, DT_S, before, between or after, after, arrived, did, usual_age_s=0.6)


def found(*periods: Period) -> set[str]:
    """Numbers of the invariants that the periods violate, one after the other."""
    invariants = all_invariants(TASK, max_age_s=15.0)
    return {each.invariant for every in periods for each in violations(invariants, every)}


SOUND = {
    "standing still": [period(STILL, STILL)],
    "a drag": [period(DIRECT, moving(DIRECT), hand())],
    "an execution begins": [period(STILL, moving(AUTONOMOUS), did=(ran(Action.EXECUTE),))],
    "a stop": [period(moving(AUTONOMOUS, 0.3), moving(STOPPED, 0.15), stop())],
    "a stop that is said again after the reset": [
        period(STILL, STOPPED, stop()),
        period(STOPPED, DISARMED, did=(ran(Action.RESET),)),
        period(DISARMED, STOPPED, stop()),
    ],
    "an abort": [period(moving(AUTONOMOUS), STILL, did=(ran(Action.ABORT),))],
    "an execution goes on without a lease": [period(AUTONOMOUS, replace(AUTONOMOUS, lease_id=""))],
}
FAULTS = {
    "1a by itself": ("1a", [period(STILL, AUTONOMOUS)]),
    "1a of another lease": ("1a", [period(STILL, DIRECT, did=(ran(Action.COUPLE, lease_id="other"),))]),
    "1a without a lease": ("1a", [period(STILL, AUTONOMOUS, did=(ran(Action.EXECUTE, holder="", lease_id=""),))]),
    "1a not armed": ("1a", [period(DISARMED, AUTONOMOUS, did=(ran(Action.EXECUTE),))]),
    "1b": ("1b", [period(DIRECT, replace(DIRECT, lease_id="other"))]),
    "1b no coupling": ("1b", [period(DIRECT, replace(DIRECT, coupling=None))]),
    "1c": ("1c", [period(AUTONOMOUS, STILL)]),
    "2 no input": ("2", [period(DIRECT, moving(DIRECT))]),
    "2 of an earlier coupling": ("2", [period(DIRECT, moving(DIRECT), hand(coupling_id=7))]),
    "2 of another boot": ("2", [period(DIRECT, moving(DIRECT), hand(boot="old"))]),
    "3 ignored": ("3", [period(AUTONOMOUS, AUTONOMOUS, stop())]),
    "3 ignored since it was known": ("3", [period(STILL, STOPPED, stop()), period(AUTONOMOUS, AUTONOMOUS, stop())]),
    "3 left by itself": ("3", [period(STOPPED, DISARMED)]),
    "4 faster in HOLD": ("4", [period(STILL, moving(STILL))]),
    "4 a reset that moves": ("4", [period(STOPPED, moving(DISARMED), did=(ran(Action.RESET),))]),
    "5 velocity": ("5", [period(moving(DIRECT, 0.5), moving(DIRECT, 0.0001), hand())]),
    "5 position": ("5", [period(STILL, replace(STILL, position_m=np.array([0.6, 0.5])))]),
    "6": ("6", [period(STILL, AUTONOMOUS, between=STILL, did=(ran(Action.EXECUTE),))]),
    "7 a command": ("7", [period(STILL, AUTONOMOUS, did=(ran(Action.EXECUTE, flight_s=1.7),))]),
    "7 inputs": ("7", [period(DIRECT, moving(DIRECT), hand(flight_s=1.7))]),
    "dead-man": (
        "Driving",
        [period(DIRECT, DIRECT, hand()), period(moving(DIRECT), moving(DIRECT), time_s=100.8)],
    ),
    "twice": ("Freshness", [period(STILL, STILL, did=(ran(Action.ARM),))] * 2),
}  # fmt: skip


@pytest.mark.parametrize("periods", SOUND.values(), ids=SOUND.keys())
def test_what_is_allowed_violates_nothing(periods):
    assert found(*periods) == set()


@pytest.mark.parametrize(("number", "periods"), FAULTS.values(), ids=FAULTS.keys())
def test_a_fault_is_found_by_its_invariant(number, periods):
    assert number in found(*periods)


def test_every_invariant_has_its_sentence_and_a_fault_that_shows_it():
    invariants = all_invariants(TASK, 15.0)
    assert all(invariant.sentence for invariant in invariants)
    assert {invariant.number for invariant in invariants} == {number for number, _ in FAULTS.values()}
