from __future__ import annotations

from farhand.common.wire.messages import Stamp, StopAck
from farhand.remote_site.supervision.stops import Stops

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
