from __future__ import annotations

import pytest

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire.messages import Event, Stamp, StopAck
from farhand.remote_site.supervision.stop import Stops
from tests.remote_site.bench import BEGINNINGS, Bench, in_mode

NOW = Stamp("boot", 5)


def acks_of(stops_said: list[StopAck]) -> list[tuple[str, bool]]:
    return [(ack.stop_id, ack.standing) for ack in stops_said]


def test_a_stop_is_acknowledged_when_received_and_when_the_robot_stands():
    said: list[StopAck] = []
    stops = Stops(said.append)
    assert stops.receive("a", NOW)
    assert acks_of(said) == [("a", False)]
    stops.stands(NOW)
    assert acks_of(said) == [("a", False), ("a", True)]
    stops.stands(NOW)
    assert len(said) == 2


def test_a_stop_that_is_resent_is_no_new_one_and_hears_all_that_it_missed():
    said: list[StopAck] = []
    stops = Stops(said.append)
    stops.receive("a", NOW)
    assert not stops.receive("a", NOW)
    assert acks_of(said) == [("a", False)] * 2
    stops.stands(NOW)
    said.clear()
    assert not stops.receive("a", NOW)
    assert acks_of(said) == [("a", False), ("a", True)]


def test_several_operators_each_hear_of_their_own():
    said: list[StopAck] = []
    stops = Stops(said.append)
    stops.receive("a", NOW)
    assert stops.receive("b", NOW)
    stops.stands(NOW)
    assert acks_of(said)[2:] == [("a", True), ("b", True)]


def test_a_flood_of_stops_takes_no_more_room_than_the_newest():
    stops = Stops(lambda ack: None)
    for number in range(10_000):
        assert stops.receive(f"stop {number}", NOW)
    assert len(stops._known) == 64 and not stops.receive("stop 9999", NOW)


@pytest.mark.parametrize("mode", [mode for mode in ControlMode if mode is not ControlMode.STOPPED])
def test_a_stop_that_is_known_stops_a_robot_that_has_left_stopped(mode: ControlMode):
    bench = Bench()
    bench.stop("held up")
    bench.run(0.5)
    assert bench.ask_lease().granted and bench.command(Action.RESET).accepted
    if mode is not ControlMode.DISARMED:
        BEGINNINGS[mode](bench)
    assert bench.mode is mode
    bench.said.clear()
    bench.stop("held up")
    assert bench.mode is ControlMode.STOPPED
    assert acks_of(bench.heard(StopAck)) == [("held up", False)]
    bench.run(0.5)
    assert acks_of(bench.heard(StopAck))[-1] == ("held up", True)
    assert [event.who for event in bench.events("stopped")] == ["bob"]


def test_a_stop_that_is_resent_while_the_robot_is_stopped_is_told_once():
    bench = in_mode(ControlMode.AUTONOMOUS)
    for _ in range(5):
        bench.stop("resent")
        bench.run(0.2)
    assert len(bench.events("stopped")) == 1
    assert sum(event.kind == "stopped" for event in bench.heard(Event)) == 1
