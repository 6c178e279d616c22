"""What the mode machine does with a cause, beyond where the table says that it leads."""

from __future__ import annotations

import pytest

from farhand.common.mode_table import Action, ControlMode, Guard, Phase, mode_after
from farhand.common.wire.messages import Event, Stop
from farhand.common.wire.reasons import Code, because
from farhand.remote_site.supervision.guards import Trip
from tests.messages import said
from tests.remote_site.bench import DT_S, Bench, FeelingPlant, in_mode

WHY = because(Code.LINK_LOST, silent_s=2.5, policy="pauses")
BY_TRIP = [g for g in Guard if g not in (Guard.MANOEUVRE_ENDED, Guard.FORCE)]


@pytest.mark.parametrize("guard", BY_TRIP)
@pytest.mark.parametrize("mode", ControlMode)
def test_a_guard_leads_where_the_table_says_and_says_why_or_does_nothing(mode: ControlMode, guard: Guard):
    bench = in_mode(mode)
    machine, expected = bench.robot.machine, mode_after(mode, bench.robot.phase, guard)
    bench.said.clear()
    assert machine.trip(Trip(guard, WHY)) == (expected is not None)
    assert bench.mode is (expected or mode)
    told = [(e.reason, e.measured, e.succeeded, e.mode) for e in bench.heard(Event) if e.kind != "failed"]
    assert told == ([(WHY, 2.5, False, expected)] if expected else [])


@pytest.mark.parametrize("guard", [Guard.LINK_LOST_RETRACT, Guard.PERCEPTION_LOST, Guard.FAULT])
def test_only_what_pauses_keeps_the_execution(guard: Guard):
    bench = Bench().executing()
    execution = bench.robot.motion.execution
    assert execution is not None
    bench.robot.machine.trip(Trip(guard, WHY))
    kept = guard is Guard.PERCEPTION_LOST
    assert (bench.robot.motion.execution is execution) == kept
    ending = bench.ending(execution.command.command_id)
    assert (ending is None) == kept
    if ending is not None:
        assert not ending.succeeded and ending.reason == WHY


def test_the_phase_is_told_in_autonomous_alone():
    bench = Bench().executing()
    assert bench.robot.phase is Phase.APPROACHING
    bench.command(Action.PAUSE)
    assert bench.robot.phase is Phase.NONE
    bench.command(Action.RESUME)
    assert bench.robot.phase is Phase.APPROACHING


def test_a_manoeuvre_that_the_operator_ends_has_failed():
    bench = Bench().armed()
    reply = bench.command(Action.GO_TO_READY)
    bench.command(Action.ABORT)
    ending = bench.ending(reply.command_id)
    assert ending is not None and ending.kind == "failed" and "abort" in said(ending)


def test_a_manoeuvre_that_did_not_get_there_says_so_and_holds():
    bench = Bench(plant=FeelingPlant()).armed()
    reply = bench.command(Action.GO_TO_READY)
    manoeuvre = bench.robot.motion.manoeuvre
    assert manoeuvre is not None
    bench.robot.machine.end_manoeuvre(manoeuvre)
    ending = bench.ending(reply.command_id)
    assert ending is not None and "before its goal was reached" in said(ending)
    assert bench.mode is ControlMode.HOLD


def test_each_coupling_has_a_number_of_its_own():
    bench, numbers = Bench().armed(), []
    for _ in range(3):
        assert bench.command(Action.COUPLE).accepted
        coupling = bench.robot.motion.coupling
        assert coupling is not None
        numbers.append(coupling.coupling_id)
        bench.command(Action.CLUTCH)
        bench.run(DT_S)
    assert len(set(numbers)) == 3 and min(numbers) > 0


def test_a_stop_tells_who_pressed_it():
    bench = Bench().armed()
    bench.robot.machine.stop(Stop(stop_id="x", site_name="bob"))
    (event,) = bench.events("stopped")
    assert event.who == "bob" and event.mode is ControlMode.STOPPED


def test_what_was_not_checked_against_the_table_is_a_mistake_of_ours():
    bench = Bench()
    with pytest.raises(AssertionError, match="was not checked"):
        bench.robot.machine._enter(Action.COUPLE, WHY)
