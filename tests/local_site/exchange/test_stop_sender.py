from __future__ import annotations

import threading

import pytest

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.messages import Stamp, Stop, StopAck, Telemetry
from farhand.evaluation.harness.steered_world import SteppedTime
from farhand.local_site.exchange.stop_sender import StopLane, StopStatus
from tests.loopback import joined


class Bench:
    """A lane with a clock, and what it sent."""

    def __init__(self) -> None:
        self.time = SteppedTime(10.0)
        _, self.link = joined()
        self.lane = StopLane(self.link, "ann", lambda: self.time.ns * 1e-9)
        self._seq = 0

    def at(self, time_s: float) -> None:
        self.time.ns = round(time_s * 1e9)
        self.lane.tick()

    @property
    def sent(self) -> list[Stop]:
        assert {channel for channel, _ in self.link.sent} <= {keys.STOP}
        return [decode(data, Stop) for _, data in self.link.sent]

    @property
    def status(self) -> StopStatus:
        assert self.lane.status is not None
        return self.lane.status

    def ack(self, standing: bool, stop_id: str = "", t_ns: int = 1000, boot: str = "boot") -> None:
        stop_id = stop_id or self.sent[-1].stop_id
        self.lane.acknowledged(StopAck(stop_id=stop_id, standing=standing, stamp=Stamp(boot, t_ns)))

    def report(self, mode: ControlMode, t_ns: int = 2000, boot: str = "boot") -> None:
        self._seq += 1
        self.lane.reported(
            Telemetry(
                seq=self._seq, stamp=Stamp(boot, t_ns), mode=mode, position_m=(0.5, 0.5), frame_origin_m=(0.7, 0.3)
            )
        )  # fmt: skip


def test_a_stop_goes_out_at_once_in_the_sites_name():
    bench = Bench()
    bench.lane.press()
    assert [stop.site_name for stop in bench.sent] == ["ann"]
    assert bench.status == StopStatus(10.0)


def test_it_is_resent_soon_and_then_every_fifth_of_a_second_with_one_id_until_the_robot_stands():
    bench = Bench()
    bench.lane.press()
    for since_s, n_sent in ((0.09, 1), (0.11, 2), (0.2, 2), (0.22, 3), (5.0, 4), (5.19, 4)):
        bench.at(10.0 + since_s)
        assert len(bench.sent) == n_sent
    assert len({stop.stop_id for stop in bench.sent}) == 1
    bench.ack(standing=False)
    bench.at(15.3)
    assert len(bench.sent) == 5
    bench.ack(standing=True)
    bench.at(20.0)
    assert len(bench.sent) == 5 and bench.status.standing


def test_nothing_is_sent_that_nobody_pressed():
    bench = Bench()
    bench.at(11.0)
    bench.ack(True, "another")
    bench.report(ControlMode.STOPPED)
    assert bench.lane.status is None and not bench.link.sent


def test_acknowledgements_that_overtake_each_other_do_not_take_back_that_it_stands():
    bench = Bench()
    bench.lane.press()
    bench.ack(standing=True)
    bench.ack(standing=False)
    assert bench.status.standing


def test_each_press_is_a_new_stop_and_the_operator_has_waited_since_the_first():
    bench = Bench()
    bench.lane.press()
    bench.at(12.0)
    for _ in range(3):
        bench.lane.press()
    ids = [stop.stop_id for stop in bench.sent]
    assert len(set(ids)) == 4 and bench.status.pressed_s == 10.0
    bench.at(12.3)
    assert bench.sent[-1].stop_id == ids[-1]


@pytest.mark.parametrize("which", ["another", "the press before"])
def test_the_acknowledgement_of_another_stop_does_not_count(which: str):
    bench = Bench()
    bench.lane.press()
    before = bench.sent[-1].stop_id
    bench.lane.press()
    bench.ack(True, before if which != "another" else which)
    bench.report(ControlMode.STOPPED)
    assert not bench.status.received and not bench.status.settled


def test_a_stop_is_settled_by_a_report_that_was_made_after_the_robot_stood():
    bench = Bench()
    bench.report(ControlMode.STOPPED, t_ns=999)
    bench.lane.press()
    bench.ack(standing=True, t_ns=1000)
    assert bench.status.standing and not bench.status.settled
    bench.report(ControlMode.STOPPED, t_ns=1001)
    assert bench.status.settled


def test_a_report_that_overtook_the_acknowledgement_counts():
    bench = Bench()
    bench.lane.press()
    bench.report(ControlMode.STOPPED, t_ns=1001)
    bench.ack(standing=True, t_ns=1000)
    assert bench.status.settled


@pytest.mark.parametrize("mode", [ControlMode.AUTONOMOUS, ControlMode.DIRECT])
def test_an_acknowledgement_of_the_past_does_not_hide_that_the_robot_moves_now(mode: ControlMode):
    bench = Bench()
    bench.lane.press()
    bench.report(mode, t_ns=5000)  # somebody has reset it meanwhile
    bench.ack(standing=True, t_ns=1000)
    assert bench.status.moves_again and not bench.status.settled
    bench.report(ControlMode.HOLD, t_ns=6000)
    assert bench.status.settled and not bench.status.moves_again


def test_a_report_that_waited_out_an_outage_settles_nothing_for_good():
    bench = Bench()
    bench.lane.press()
    bench.ack(standing=True)
    bench.report(ControlMode.STOPPED, t_ns=2000)
    assert bench.status.settled
    bench.report(ControlMode.AUTONOMOUS, t_ns=9000)
    assert bench.status.moves_again


def test_what_happens_after_a_stop_was_settled_is_no_alarm():
    bench = Bench()
    bench.lane.press()
    bench.ack(standing=True)
    bench.report(ControlMode.STOPPED)
    bench.at(14.0)
    bench.report(ControlMode.AUTONOMOUS, t_ns=3000)
    assert bench.status.settled
    bench.lane.press()
    assert not bench.status.settled and bench.status.pressed_s == 14.0 and not bench.status.received


def test_who_resets_and_executes_at_once_is_not_warned_of_the_own_reset():
    bench = Bench()
    bench.lane.press()
    bench.ack(standing=True)
    bench.report(ControlMode.STOPPED)
    bench.lane.commanded(Action.RESET)
    bench.report(ControlMode.AUTONOMOUS, t_ns=3000)
    assert bench.status.settled and not bench.status.moves_again


def test_only_a_restarted_robots_later_report_is_held_against_the_acknowledgement():
    bench = Bench()
    bench.report(ControlMode.AUTONOMOUS, t_ns=5000, boot="before")
    bench.lane.press()
    bench.ack(standing=True, t_ns=10, boot="after")
    assert not bench.status.settled and not bench.status.moves_again
    bench.report(ControlMode.STOPPED, t_ns=20, boot="after")
    assert bench.status.settled


def test_the_lane_resends_by_itself_in_real_time():
    there, here = joined()
    lane = StopLane(here, "ann")
    heard: list[bytes] = []
    enough = threading.Event()

    def hear(data: bytes) -> None:
        heard.append(data)
        if len(heard) == 3:
            enough.set()

    there.subscribe(keys.STOP, hear)
    lane.start()
    try:
        lane.press()
        assert enough.wait(60.0)
    finally:
        lane.close()
