from __future__ import annotations

import signal
import threading
from collections.abc import Iterator

import pytest

from farhand.deploy.end_signals import END_SIGNALS, on_end_signal

PATIENCE_S = 20.0


@pytest.fixture(autouse=True)
def handlers_put_back() -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in END_SIGNALS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", END_SIGNALS)
def test_a_signal_inside_the_lock_that_the_end_needs_waits_for_nothing(number):
    lock, ended = threading.Lock(), threading.Event()

    def end() -> None:
        with lock:
            ended.set()

    on_end_signal(end)
    with lock:
        signal.raise_signal(number)
        assert not ended.is_set()
    assert ended.wait(PATIENCE_S)


def test_a_second_signal_ends_nothing_twice():
    calls, called = [], threading.Event()

    def end() -> None:
        calls.append(None)
        called.set()

    on_end_signal(end)
    for number in END_SIGNALS:
        signal.raise_signal(number)
    assert called.wait(PATIENCE_S)
    assert len(calls) == 1
