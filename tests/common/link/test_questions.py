"""Questions in copies: handled once, answered to every copy, and to the asker once."""

from __future__ import annotations

import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farhand.common.link.questions import Copies, Once, OnceRequest, Question


@given(
    st.lists(st.tuples(st.integers(0, 4), st.sampled_from(["copy", "answer", "drop"])), max_size=60),
)
def test_each_question_is_handled_once_until_it_is_dropped_and_every_copy_gets_the_same_answer(steps):
    """Copies, answers and dropped questions in any order."""
    handled: dict[int, list[OnceRequest]] = {}
    once = Once(lambda request: handled.setdefault(request.data[0], []).append(request))
    sent: dict[int, int] = {}
    got: dict[int, list[bytes]] = {}
    answered, dropped = dict[int, bytes](), set[int]()
    for n, what in steps:
        if what == "copy":
            before = len(handled.get(n, []))
            sent[n] = sent.get(n, 0) + 1
            once.take(bytes([n]), bytes([n]), got.setdefault(n, []).append)
            is_new = before == 0 and n not in answered
            assert len(handled.get(n, [])) - before == (1 if is_new else 0)
            if is_new and n in dropped:
                sent[n] = 1  # the copies of before were dropped with it
            dropped.discard(n)
        elif what == "answer" and handled.get(n):
            answered[n] = b"answer %d" % n
            handled.pop(n)[0].answer(answered[n])
        elif what == "drop" and handled.get(n):
            handled.pop(n)
            dropped.add(n)
    for n, data in answered.items():
        assert set(got[n]) == {data}
        assert len(got[n]) >= 1
        if n not in handled:
            assert len(got[n]) <= sent[n]


def test_the_first_answer_counts_and_ends_the_copies():
    answers: list[bytes | None] = []
    copies, sent = Copies(), threading.Semaphore(0)
    question = Question(answers.append)
    try:
        copies.add(question, sent.release)
        for _ in range(3):
            assert sent.acquire(timeout=20.0)
        copies.answered(question.id, b"first")
        copies.answered(question.id, b"second")
        question.on_end()
        assert answers == [b"first"]
        assert not sent.acquire(timeout=0.5)  # the next copies would be due
    finally:
        copies.close()


@pytest.mark.parametrize("suspended_s", [9.0, 60.0, 1e6])
def test_after_a_suspend_no_copy_of_an_earlier_question_is_sent(monkeypatch, suspended_s: float):
    now_s = [1000.0]
    monkeypatch.setattr("farhand.common.link.questions.elapsed_s", lambda: now_s[0])
    copies, sent, later = Copies(), threading.Semaphore(0), threading.Semaphore(0)
    try:
        copies.add(Question(lambda _: None), sent.release)
        assert sent.acquire(timeout=20.0)
        now_s[0] += suspended_s
        copies.add(
            Question(lambda _: None), later.release
        )  # wakes the thread, as the end of the suspend does
        assert later.acquire(timeout=20.0)
        now_s[0] += 0.15
        copies.add(Question(lambda _: None), later.release)
        assert all(later.acquire(timeout=20.0) for _ in range(2))
        assert not sent.acquire(blocking=False)
    finally:
        copies.close()


def test_the_end_of_the_transports_replies_counts_as_no_answer():
    answers: list[bytes | None] = []
    question = Question(answers.append)
    assert question.is_open
    question.on_end()
    assert answers == [None]
    assert not question.is_open
