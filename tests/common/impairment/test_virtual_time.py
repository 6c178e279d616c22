from __future__ import annotations

from functools import partial

from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.clock import VirtualTime


@settings(deadline=None, derandomize=True, max_examples=100)
@given(st.lists(st.floats(0, 100), max_size=20), st.floats(0, 100))
def test_what_is_due_is_done_in_order_and_at_its_time_and_nothing_else(times_s, until_s):
    time, done = VirtualTime(), []
    for number, time_s in enumerate(times_s):
        time.call_at(time_s, lambda number=number: done.append((time.now_s(), number)))
    time.run_until(until_s)
    assert done == sorted((time_s, number) for number, time_s in enumerate(times_s) if time_s <= until_s)
    assert time.now_s() == until_s


def test_a_job_may_ask_for_others_and_what_is_over_is_done_at_once():
    time, done = VirtualTime(start_s=5.0), []

    def first() -> None:
        time.call_at(1.0, partial(done.append, "late"))
        time.call_later(2.0, partial(done.append, "later"))

    time.call_later(1.0, first)
    time.run_until(6.5)
    assert done == ["late"]
    time.run_until(8.0)
    assert done == ["late", "later"]
    assert time.now_ns() == 8_000_000_000


def test_somebody_may_act_after_each_job():
    time, done = VirtualTime(), []
    time.call_at(1.0, partial(done.append, "job"))
    time.call_at(2.0, partial(done.append, "job"))
    time.run_until(3.0, partial(done.append, "after"))
    assert done == ["job", "after"] * 2
