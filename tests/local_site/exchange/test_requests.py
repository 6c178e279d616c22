from __future__ import annotations

from farhand.common.link.interface import Request
from farhand.common.wire import keys
from farhand.common.wire.codec import encode
from farhand.common.wire.messages import ExecutionReport, ReportRequest, Stamp
from farhand.local_site.exchange.requests import Requests
from tests.loopback import joined

ASK_TIMEOUT_S = 2.0
ANSWER = ExecutionReport(stamp=Stamp("boot", 1))
Answers = list[tuple[ExecutionReport | None, float]]


class Desk:
    """Who asks, in the test's own time, and the robot's end of the link."""

    def __init__(self) -> None:
        self.robot, self.link = joined()
        self.now_s = 100.0
        self.inquiries = Requests(self.link, lambda job: job(), lambda: self.now_s, ASK_TIMEOUT_S)

    def ask(self, give_up_s: float = 0.0) -> Answers:
        answers: Answers = []
        self.inquiries.ask(
            keys.REPORT, ReportRequest(), ExecutionReport, give_up_s, lambda *answer: answers.append(answer)
        )
        return answers

    def wait(self, duration_s: float) -> None:
        for _ in range(round(duration_s / 0.05)):
            self.now_s += 0.05
            self.inquiries.tick(self.now_s)


class Slow:
    """A robot that keeps the questions until the test answers them."""

    def __init__(self, desk: Desk) -> None:
        self.requests: list[Request] = []
        desk.robot.serve(keys.REPORT, self.requests.append)


def test_a_question_is_answered_with_the_time_that_it_took():
    desk = Desk()
    slow, answers = Slow(desk), desk.ask()
    desk.wait(1.0)
    slow.requests[0].answer(encode(ANSWER))
    [(answer, took_s)] = answers
    assert answer == ANSWER
    assert abs(took_s - 1.0) < 1e-6


def test_without_an_answer_it_gives_up_and_says_so():
    assert Desk().ask() == [(None, 0.0)]


def test_it_asks_again_with_the_same_content_until_it_is_answered():
    desk = Desk()
    desk.link.cut()
    answers = desk.ask(give_up_s=60.0)
    desk.wait(5.0)
    assert answers == []
    asked: list[bytes] = []

    def answer_the_third(request: Request) -> None:
        asked.append(request.data)
        request.answer(encode(ANSWER) if len(asked) == 3 else b"rubbish")

    desk.robot.serve(keys.REPORT, answer_the_third)
    desk.link.mend()
    desk.wait(5.0)
    assert [answer for answer, _ in answers] == [ANSWER]
    assert len(asked) == 3 and len(set(asked)) == 1


def test_it_stops_asking_when_its_time_is_over():
    desk = Desk()
    desk.link.cut()
    answers = desk.ask(give_up_s=10.0)
    desk.wait(9.0)
    assert answers == []
    desk.wait(2.0)
    assert answers == [(None, 0.0)]


def test_a_link_that_never_answers_counts_as_no_answer():
    desk = Desk()
    slow, answers = Slow(desk), desk.ask()
    desk.wait(ASK_TIMEOUT_S + 1.2)
    assert answers == [(None, 0.0)]
    slow.requests[0].answer(encode(ANSWER))
    assert len(answers) == 1


def test_of_two_answers_the_first_counts_whichever_asking_it_belongs_to():
    desk = Desk()
    slow, answers = Slow(desk), desk.ask(give_up_s=60.0)
    desk.wait(ASK_TIMEOUT_S + 2.0)
    first, second = slow.requests[:2]
    first.answer(encode(ANSWER))
    second.answer(encode(ANSWER))
    assert [answer for answer, _ in answers] == [ANSWER]


def test_an_answer_that_is_not_understood_is_no_answer():
    desk = Desk()
    desk.robot.serve(keys.REPORT, lambda request: request.answer(b"rubbish"))
    assert desk.ask() == [(None, 0.0)]


def test_after_closing_nobody_is_called_any_more():
    desk = Desk()
    slow, answers = Slow(desk), desk.ask(give_up_s=60.0)
    desk.inquiries.close()
    slow.requests[0].answer(encode(ANSWER))
    desk.wait(100.0)
    assert answers == []
    assert len(slow.requests) == 1
