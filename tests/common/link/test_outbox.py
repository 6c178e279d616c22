from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator

import pytest

from farhand.common.link.outbox import Outbox

PATIENCE_S = 30.0


class Sent:
    """A transport that can be blocked; remembers what was sent."""

    def __init__(self) -> None:
        self.items: list[object] = []
        self.open = threading.Event()
        self.open.set()
        self.entered = threading.Event()
        self._changed = threading.Condition()

    def send(self, item: object) -> Callable[[], None]:
        def put() -> None:
            self.entered.set()
            self.open.wait(PATIENCE_S)
            with self._changed:
                self.items.append(item)
                self._changed.notify_all()

        return put

    def wait(self, n: int) -> list[object]:
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.items) >= n, PATIENCE_S)
        return self.items

    def block(self, outbox: Outbox) -> None:
        """Have the outbox wait inside of a send."""
        self.open.clear()
        self.entered.clear()
        outbox.submit(self.send("blocking"))
        assert self.entered.wait(PATIENCE_S)


@pytest.fixture
def outbox() -> Iterator[Outbox]:
    box = Outbox("test", logging.getLogger(__name__))
    yield box
    box.close()


def test_messages_are_sent_in_order(outbox):
    sent = Sent()
    for number in range(100):
        outbox.submit(sent.send(number))
    assert sent.wait(100) == list(range(100))


def test_of_a_newest_only_message_only_the_newest_waits(outbox):
    sent = Sent()
    sent.block(outbox)
    for number in range(50):
        outbox.submit(sent.send(("state", number)), "state")
        outbox.submit(sent.send(("other", number)), "other")
    outbox.submit(sent.send("acknowledged"))
    sent.open.set()
    assert sent.wait(4) == ["blocking", ("state", 49), ("other", 49), "acknowledged"]


def test_the_caller_never_waits_for_a_blocked_transport(outbox, caplog):
    sent = Sent()
    sent.block(outbox)
    for number in range(3000):
        outbox.submit(sent.send(number))
    sent.open.set()
    assert sent.wait(1025)[1:] == list(range(3000 - 1024, 3000))
    assert "the oldest waiting message was dropped" in caplog.text


def test_beyond_its_byte_budget_a_message_waits_and_is_replaced_by_newer_ones(outbox):
    sent = Sent()
    outbox.limit("state", 1e-3)  # 10 B take hours
    for number in range(5):
        outbox.submit(sent.send(number), "state", 10)
        outbox.submit(sent.send("free"))
        sent.wait(number + 2)
    assert sent.items.count("free") == 5 and [item for item in sent.items if item != "free"] == [0]
    outbox.limit("state", 0.0)
    assert sent.wait(7)[-1] == 4


def test_a_budget_that_suffices_holds_nothing_back(outbox):
    sent = Sent()
    outbox.limit("state", 1e12)
    for number in range(5):
        outbox.submit(sent.send(number), "state", 200)
        sent.wait(number + 1)
    assert sent.items == [0, 1, 2, 3, 4]


def test_a_send_that_fails_does_not_end_the_sending(outbox, caplog):
    sent = Sent()

    def fail() -> None:
        raise RuntimeError("the session is closed")

    outbox.submit(fail)
    outbox.submit(sent.send("next"))
    assert sent.wait(1) == ["next"]
    assert "the session is closed" in caplog.text


def test_closing_ends_the_thread_and_sends_nothing_more():
    box, sent = Outbox("closing", logging.getLogger(__name__)), Sent()
    box.limit("state", 1e-3)
    box.submit(sent.send(1), "state", 10)
    sent.wait(1)
    box.submit(sent.send(2), "state", 10)
    box.close()
    assert sent.items == [1]
    assert "send closing" not in [thread.name for thread in threading.enumerate()]
