from __future__ import annotations

from typing import Any

from farhand.common.link.interface import Request
from farhand.common.mode_table import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import Event, EventsReply, EventsRequest, Stamp
from farhand.common.wire.reasons import in_words
from farhand.local_site.exchange.reports import EventFollower
from farhand.local_site.exchange.requests import Requests
from tests.loopback import joined
from tests.messages import said


def event(seq: int, boot: str = "one") -> Event:
    return Event(
        seq=seq, stamp=Stamp(boot, seq), kind="told", reason=in_words(f"{boot} {seq}"), mode=ControlMode.HOLD
    )


class Robot:
    """Keeps the questions until the test has it answer them."""

    def __init__(self) -> None:
        self.link, local = joined()
        self.requests: list[Request] = []
        self.link.serve(keys.EVENTS, self.requests.append)
        self.boot, self.n_events, self.kept_from = "one", 0, 1
        self.told: list[str] = []
        inquiries = Requests(local, lambda job: job(), lambda: 0.0)
        self.follower = EventFollower(inquiries, lambda told: self.told.append(said(told)))

    def asked_after(self) -> list[int]:
        return [decode(request.data, EventsRequest).after_seq for request in self.requests]

    def answer(self, **changes: Any) -> None:
        """Answer the oldest question, with 64 events at most."""
        request = self.requests.pop(0)
        after = max(decode(request.data, EventsRequest).after_seq, self.kept_from - 1)
        events = tuple(event(n, self.boot) for n in range(after + 1, self.n_events + 1))[:64]
        reply = EventsReply(events=events, newest_seq=self.n_events, stamp=Stamp(self.boot, 99))
        request.answer(encode(reply))

    def expected(self, *numbers: int) -> list[str]:
        return [f"{self.boot} {n}" for n in numbers]


def test_events_that_come_one_after_the_other_are_told_without_asking():
    robot = Robot()
    for n in (1, 2, 3):
        robot.follower.received(event(n))
    assert robot.told == robot.expected(1, 2, 3) and not robot.requests


def test_what_is_left_out_is_asked_for_and_told_once_each_in_order():
    robot = Robot()
    robot.n_events = 6
    for n in (1, 2, 6):
        robot.follower.received(event(n))
    assert robot.asked_after() == [2]
    robot.answer()
    assert robot.told == robot.expected(1, 2, 6, 3, 4, 5)
    assert not robot.requests
    robot.follower.received(event(6))
    robot.follower.received(event(7))
    assert robot.told[-1] == "one 7" and len(robot.told) == 7


def test_a_long_outage_is_caught_up_with_in_parts():
    robot = Robot()
    robot.n_events = 150
    robot.follower.catch_up("one")
    while robot.requests:
        robot.answer()
    assert robot.told == robot.expected(*range(1, 151))


def test_what_is_not_kept_any_more_is_not_asked_for_for_ever():
    robot = Robot()
    robot.follower.received(event(1))
    robot.follower.received(event(5))
    robot.n_events, robot.kept_from = 300, 45
    while robot.requests:
        robot.answer()
    robot.follower.received(event(301))
    assert robot.told == robot.expected(1, 5, *range(45, 302))
    assert not robot.requests


def test_a_restarted_robot_begins_anew_and_is_asked_at_once():
    robot = Robot()
    for n in (1, 2, 3):
        robot.follower.received(event(n))
    robot.boot, robot.n_events = "two", 1
    robot.follower.catch_up("two")
    robot.answer()
    assert robot.told[-1] == "two 1"


def test_a_restart_in_the_middle_of_a_question_loses_no_event_of_the_new_boot():
    robot = Robot()
    robot.follower.received(event(1))
    robot.follower.received(event(9))
    assert robot.asked_after() == [1]
    robot.boot, robot.n_events = "two", 3
    robot.follower.catch_up("two")
    robot.answer()  # the new boot answers what was asked of the old one
    assert robot.asked_after() == [0]
    robot.answer()
    assert robot.told[2:] == robot.expected(1, 2, 3)
    assert not robot.requests


def test_a_question_without_an_answer_is_put_again_after_the_next_outage():
    robot = Robot()
    robot.link.cut()
    robot.follower.catch_up("one")
    robot.link.mend()
    robot.n_events = 2
    robot.follower._on_reply("one", None, 0.0)  # given up
    robot.follower.catch_up("one")
    robot.answer()
    assert robot.told == robot.expected(1, 2)
