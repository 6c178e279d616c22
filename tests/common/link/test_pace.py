"""The pace of streams: two ends that exchange marks over a simulated way with delay, loss and a queue."""

from __future__ import annotations

import random

import pytest

from farhand.common.link.pace import SHARES, StreamPace
from farhand.common.wire import keys

WAY_S, PERIOD_S = 0.3, 0.04
TELEMETRY, HEARTBEAT = keys.TELEMETRY.key, keys.HEARTBEAT.key


class Ends:
    """A robot that streams reports and an operator that streams heartbeats, on clocks that differ."""

    def __init__(self, loss: float, seed: int = 0):
        self.now_s, self.loss, self.queue_s = 0.0, loss, 0.0
        self._random = random.Random(seed)
        self.robot = StreamPace(1.0, lambda: self.now_s + 1234.5)
        self.operator = StreamPace(1.0, lambda: 3.0 * 86400.0 + self.now_s)
        self._on_the_way: list[tuple[float, StreamPace, str, bytes]] = []

    def run(self, duration_s: float) -> None:
        end_s = self.now_s + duration_s
        while self.now_s < end_s:
            self.now_s += PERIOD_S
            for sender, receiver, channel, queue_s in (
                (self.robot, self.operator, TELEMETRY, self.queue_s),
                (self.operator, self.robot, HEARTBEAT, 0.0),
            ):
                mark = sender.mark(channel)
                if self._random.random() >= self.loss:
                    self._on_the_way.append((self.now_s + WAY_S + queue_s, receiver, channel, mark))
            due = [entry for entry in self._on_the_way if entry[0] <= self.now_s]
            self._on_the_way = [entry for entry in self._on_the_way if entry[0] > self.now_s]
            for _, receiver, channel, mark in sorted(due, key=lambda entry: entry[0]):
                receiver.heard(channel, mark)


def test_without_loss_the_streams_take_what_they_want_once_that_is_known():
    ends = Ends(loss=0.0)
    assert ends.robot.rate_bytes_s == 0.0  # nobody is there yet
    ends.run(1.0)
    assert ends.robot.rate_bytes_s > 0.0  # slowly, until it is known that nothing is lost
    ends.run(3.0)
    assert ends.robot.rate_bytes_s == 0.0
    assert ends.robot.round_trip_s == pytest.approx(2 * WAY_S, abs=PERIOD_S + 0.01)


@pytest.mark.parametrize("loss", [0.05, 0.1, 0.2])
def test_what_is_streamed_on_a_lossy_link_fits_into_one_packet_a_round_trip(loss: float):
    ends = Ends(loss)
    ends.run(20.0)
    for end in (ends.robot, ends.operator):
        assert end.rate_bytes_s * 2 * WAY_S == pytest.approx(1400, rel=0.1)
    assert sum(SHARES[channel] for channel in (keys.INPUT, keys.HEARTBEAT)) < 1.0
    assert SHARES[keys.TELEMETRY] < 1.0


def test_an_outage_is_no_loss():
    ends = Ends(loss=0.0)
    ends.run(10.0)
    ends.loss = 1.0
    ends.run(4.0)
    ends.loss = 0.0
    ends.run(2.0)
    assert ends.robot.rate_bytes_s == 0.0


def test_a_queue_slows_the_streams_down_until_it_is_empty():
    ends = Ends(loss=0.0)
    ends.run(10.0)
    ends.queue_s = 0.5
    ends.run(2.0)
    slowed = ends.robot.rate_bytes_s
    assert 0.0 < slowed * 2 * WAY_S < 700
    ends.queue_s = 0.0
    ends.run(2.0)
    assert ends.robot.rate_bytes_s == 0.0


def test_marks_of_another_form_are_ignored():
    pace = StreamPace(1.0)
    for mark in (b"", b"x", bytes(100)):
        pace.heard(TELEMETRY, mark)
    assert pace.round_trip_s is None
    assert pace.rate_bytes_s == 0.0
