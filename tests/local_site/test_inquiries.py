from __future__ import annotations

import queue
import threading
from collections.abc import Iterator

import pytest

from common import keys
from common.codec import encode
from common.link import Request
from common.messages import ExecutionReport, ReportRequest, Stamp
from local_site.inquiries import Inquiries
from tests.loopback import Loopback

PATIENCE_S = 60.0
ANSWER = ExecutionReport(stamp=Stamp("boot", 1))


@pytest.fixture
def ends() -> Iterator[tuple[Loopback, Inquiries]]:
    """The robot's end of the link, and who asks at the other."""
    remote, local = Loopback.pair()
    inquiries = Inquiries(local, ask_timeout_s=0.2)
    yield remote, inquiries
    inquiries.close()


def ask(inquiries: Inquiries, give_up_s: float) -> tuple[ExecutionReport | None, float]:
    answers: queue.SimpleQueue[tuple[ExecutionReport | None, float]] = queue.SimpleQueue()
    inquiries.ask(
        keys.REPORT, ReportRequest(), ExecutionReport, give_up_s, lambda *answer: answers.put(answer)
    )
    return answers.get(timeout=PATIENCE_S)


def test_a_question_is_answered_with_the_time_that_it_took(ends):
    remote, inquiries = ends
    remote.serve(keys.REPORT, lambda request: request.answer(encode(ANSWER)))
    answer, took_s = ask(inquiries, 0.0)
    assert answer == ANSWER and took_s >= 0.0
    assert inquiries.ask_and_wait(keys.REPORT, ReportRequest(), ExecutionReport, PATIENCE_S) == ANSWER


def test_without_an_answer_it_gives_up_and_says_so(ends):
    _, inquiries = ends
    assert ask(inquiries, 0.0) == (None, 0.0)
    assert inquiries.ask_and_wait(keys.REPORT, ReportRequest(), ExecutionReport, PATIENCE_S) is None


def test_it_asks_again_with_the_same_content_until_it_is_answered(ends):
    remote, inquiries = ends
    asked: list[bytes] = []

    def answer_the_third(request: Request) -> None:
        asked.append(request.data)
        if len(asked) == 3:
            request.answer(encode(ANSWER))

    remote.serve(keys.REPORT, answer_the_third)
    assert ask(inquiries, PATIENCE_S)[0] == ANSWER
    assert len(asked) == 3 and len(set(asked)) == 1


def test_an_answer_that_is_not_understood_is_no_answer(ends):
    remote, inquiries = ends
    remote.serve(keys.REPORT, lambda request: request.answer(b"rubbish"))
    assert ask(inquiries, 0.0)[0] is None


def test_after_closing_nobody_is_called_any_more(ends):
    remote, inquiries = ends
    asked, called = threading.Event(), threading.Event()
    remote.serve(keys.REPORT, lambda request: asked.set())
    inquiries.ask(keys.REPORT, ReportRequest(), ExecutionReport, PATIENCE_S, lambda *_: called.set())
    assert asked.wait(PATIENCE_S)
    inquiries.close()
    inquiries.ask(keys.REPORT, ReportRequest(), ExecutionReport, 0.0, lambda *_: called.set())
    inquiries._workers.shutdown(wait=True)
    assert not called.is_set()
