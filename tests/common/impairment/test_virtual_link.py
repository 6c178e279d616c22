"""The link in virtual time: what a `Link` promises, and what it does to messages."""

from __future__ import annotations

import pytest

from farhand.common.clock import VirtualTime
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.impairment.virtual_link import VirtualEnd, VirtualLink
from farhand.common.link.budget import OVERHEAD_BYTES
from farhand.common.link.interface import Request
from farhand.common.wire import keys

FAR = LinkSettings(uplink=DirectionSettings(delay_ms=300), downlink=DirectionSettings(delay_ms=500))


class Bench:
    def __init__(self, settings: LinkSettings = FAR):
        self.time = VirtualTime()
        self.link = VirtualLink(self.time, settings)
        self.local, self.remote = self.link.local_end(), self.link.remote_end()
        self.heard: list[tuple[float, bytes]] = []
        self.answers: list[tuple[float, bytes | None]] = []
        for channel in keys.ALL:
            self.remote.subscribe(channel, self.hear)

    def hear(self, data: bytes) -> None:
        self.heard.append((round(self.time.now_s(), 6), data))

    def ask(self, data: bytes, timeout_s: float = 10.0) -> None:
        self.local.ask(
            keys.COMMAND, data, timeout_s,
            lambda answer: self.answers.append((round(self.time.now_s(), 6), answer)),
        )  # fmt: skip

    def at(self, time_s: float) -> VirtualEnd:
        self.time.run_until(time_s)
        return self.local


def test_a_message_arrives_after_the_delay_of_its_way():
    bench = Bench()
    bench.local.send(keys.EVENT, b"a")
    bench.at(0.1).send(keys.EVENT, b"b")
    bench.at(5.0)
    assert bench.heard == [(0.3, b"a"), (0.4, b"b")]


def test_a_question_is_answered_after_both_ways_once():
    bench = Bench()
    bench.remote.serve(keys.COMMAND, lambda request: request.answer(request.data[::-1]))
    bench.ask(b"abc")
    bench.at(60.0)
    assert bench.answers == [(0.8, b"cba")]


def test_an_answer_may_be_given_later():
    bench, held = Bench(), []
    bench.remote.serve(keys.COMMAND, held.append)
    bench.ask(b"abc")
    bench.at(2.0)
    request: Request = held[0]
    request.answer(b"at last")
    bench.at(60.0)
    assert bench.answers == [(2.5, b"at last")]


def test_a_question_that_nobody_answers_ends_after_its_time():
    bench = Bench()
    bench.ask(b"?", timeout_s=3.0)
    bench.at(60.0)
    assert bench.answers == [(3.0, None)]


def test_a_cut_loses_what_is_under_way_and_lets_nothing_in():
    bench = Bench()
    bench.local.send(keys.EVENT, b"lost")
    bench.at(0.1)
    bench.link.cut()
    bench.local.send(keys.EVENT, b"not sent")
    bench.ask(b"?")
    bench.at(1.0)
    bench.link.mend()
    bench.local.send(keys.EVENT, b"after")
    bench.at(60.0)
    assert bench.heard == [(1.3, b"after")]
    assert bench.answers == [(0.1, None)]


def test_after_a_stall_everything_arrives_at_once_and_in_order():
    bench = Bench()
    for number in range(3):
        bench.at(0.1 * number).send(keys.EVENT, b"%d" % number)
    bench.link.stall(10.0)
    bench.at(60.0)
    assert bench.heard == [(10.2, b"0"), (10.2, b"1"), (10.2, b"2")]


def test_what_a_blackhole_swallows_never_arrives_and_is_not_noticed_before_the_patience_ends():
    bench = Bench()
    bench.local.send(keys.EVENT, b"under way")
    bench.link.swallow(2.0)
    bench.ask(b"lost")
    bench.at(1.9).send(keys.EVENT, b"held")
    bench.at(2.0).send(keys.EVENT, b"after")
    bench.at(20.0)
    assert bench.heard == [(2.3, b"after")]
    assert bench.answers == [(10.0, None)]


def test_of_telemetry_that_waits_for_room_only_the_newest_is_sent_and_stops_pass_it():
    narrow = DirectionSettings(rate_bps=8 * (OVERHEAD_BYTES + 100), queue_bytes=1)
    bench = Bench(LinkSettings(uplink=narrow))
    bench.local.send(keys.EVENT, bytes(100))  # takes a second
    for number in range(5):
        bench.at(0.1 * number).send(keys.TELEMETRY, b"%d" % number)
    bench.local.send(keys.STOP, b"stop")
    bench.at(60.0)
    assert [data for _, data in bench.heard] == [bytes(100), b"stop", b"4"]


def test_a_byte_budget_holds():
    bench = Bench(LinkSettings())
    bench.local.limit(keys.TELEMETRY, 100.0)
    for number in range(100):
        bench.at(0.1 * number).send(keys.TELEMETRY, bytes(50))
    bench.at(60.0)
    gaps = [later[0] - earlier[0] for earlier, later in zip(bench.heard, bench.heard[1:], strict=False)]
    assert min(gaps) == pytest.approx((50 + OVERHEAD_BYTES) / 100.0, abs=0.11)


def test_messages_are_lost_and_doubled_by_the_settings():
    both = DirectionSettings(loss=30, duplicate=30, seed=4)
    bench = Bench(LinkSettings(uplink=both))
    for number in range(1000):
        bench.at(0.01 * number).send(keys.EVENT, b"%d" % number)
    bench.at(60.0)
    kept = {data for _, data in bench.heard}
    assert 640 < len(kept) < 760
    assert 1.2 < len(bench.heard) / len(kept) < 1.4


def test_a_new_end_takes_the_place_of_the_one_before_and_gets_none_of_its_answers():
    bench = Bench()
    bench.remote.serve(keys.COMMAND, lambda request: request.answer(b"yes"))
    bench.ask(b"?")
    bench.at(0.5)
    bench.local.close()
    bench.local, heard = bench.link.local_end(), []
    bench.local.subscribe(keys.EVENT, heard.append)
    bench.remote.send(keys.EVENT, b"hello")
    bench.at(60.0)
    assert bench.answers == []
    assert heard == [b"hello"]
