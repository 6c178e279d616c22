from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator

import pytest

from farhand.deploy.outcome import END_SIGNALS, on_end_signal

PATIENCE_S = 20.0


@pytest.fixture(autouse=True)
def handlers_put_back() -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in END_SIGNALS}
    yield
    os.close(signal.set_wakeup_fd(-1))
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
    signal.raise_signal(signal.SIGTERM)
    assert called.wait(PATIENCE_S)
    for number in END_SIGNALS * 3:
        signal.raise_signal(number)  # pytest fails if the interpreter complains that nobody reads any more
    assert len(calls) == 1


@pytest.mark.parametrize("number", END_SIGNALS)
def test_a_signal_is_heard_while_the_main_thread_waits_and_is_not_woken_by_it(number):
    """As when it begins to wait for ever just as the signal comes."""
    ended, other_ends = threading.Event(), threading.Event()
    on_end_signal(ended.set)
    other = threading.Thread(target=other_ends.wait, daemon=True)
    other.start()
    assert other.ident is not None
    signal_other = threading.Timer(0.2, signal.pthread_kill, (other.ident, number))
    signal_other.start()
    assert ended.wait(PATIENCE_S)
    other_ends.set()
    other.join()
