"""Over real sessions of the transport, on free ports of this machine."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable, Iterator

import pytest

from farhand.common.errors import LinkError
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import Request, ZenohLink
from farhand.common.wire import keys
from farhand.common.wire.messages import MAX_BYTES
from tests.ports import free_port

PATIENCE_S = 30.0


class Collected:
    """What arrived, for a test to wait for."""

    def __init__(self) -> None:
        self.items: list[bytes] = []
        self._changed = threading.Condition()

    def __call__(self, data: bytes) -> None:
        with self._changed:
            self.items.append(data)
            self._changed.notify_all()

    def wait(self, holds: Callable[[list[bytes]], bool], timeout_s: float = PATIENCE_S) -> bool:
        with self._changed:
            return self._changed.wait_for(lambda: holds(self.items), timeout_s)


@pytest.fixture
def ends() -> Iterator[tuple[ZenohLink, ZenohLink]]:
    """The remote end, which listens, and the local end, which has found it."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    remote = ZenohLink(EndpointSettings(listen=endpoint))
    local = ZenohLink(EndpointSettings(connect=endpoint))
    remote.serve(keys.LEASE, lambda request: request.answer(b"here"))
    while local.ask_and_wait(keys.LEASE, b"are you there?", 5.0) != b"here":
        pass  # an unconnected question is answered with nothing at once
    yield remote, local
    local.close()
    remote.close()


def until_heard(sender: ZenohLink, channel: keys.Channel, heard: Collected) -> None:
    """A subscription becomes known to the other side a little after it was made."""
    while not heard.wait(bool, 0.05):
        sender.send(channel, b"hello")


def test_a_question_is_answered_from_any_thread(ends):
    remote, local = ends

    def handle(request: Request) -> None:
        threading.Thread(target=lambda: request.answer(request.data[::-1])).start()

    remote.serve(keys.COMMAND, handle)
    answer = None
    while answer is None:
        answer = local.ask_and_wait(keys.COMMAND, b"abc", PATIENCE_S)
    assert answer == b"cba"


def test_a_question_that_nobody_serves_comes_back_empty(ends):
    _, local = ends
    assert local.ask_and_wait(keys.REPORT, b"?", PATIENCE_S) is None


def test_a_question_that_is_never_answered_comes_back_empty_after_its_time(ends):
    remote, local = ends
    held: list[Request] = []
    seen = threading.Event()

    def hold(request: Request) -> None:
        held.append(request)
        seen.set()

    remote.serve(keys.REPORT, hold)
    while not seen.is_set():
        assert local.ask_and_wait(keys.REPORT, b"?", 0.2) is None


def test_a_question_after_the_end_comes_back_empty(ends):
    _, local = ends
    local.close()
    assert local.ask_and_wait(keys.LEASE, b"?", PATIENCE_S) is None


def test_of_reports_a_slow_receiver_sees_the_newest_only(ends):
    remote, local = ends
    heard, held, freed = Collected(), threading.Event(), threading.Event()

    def slow(data: bytes) -> None:
        heard(data)
        held.set()
        freed.wait(PATIENCE_S)

    local.subscribe(keys.TELEMETRY, slow)
    passed = Collected()
    local.subscribe(keys.EVENT, passed)
    until_heard(remote, keys.EVENT, passed)
    until_heard(remote, keys.TELEMETRY, heard)
    assert held.wait(PATIENCE_S)
    # Each report is followed by an event, which is never dropped and shows that the report has passed.
    for number in range(50):
        remote.send(keys.TELEMETRY, b"%d" % number)
        remote.send(keys.EVENT, b"%d" % number)
        assert passed.wait(lambda items, n=number: b"%d" % n in items)
    remote.send(keys.TELEMETRY, b"last")
    freed.set()
    assert heard.wait(lambda items: b"last" in items)
    assert len(heard.items) < 10


def test_events_all_arrive_in_order_however_slow_the_receiver_is(ends):
    remote, local = ends
    heard, freed = Collected(), threading.Event()

    def slow(data: bytes) -> None:
        heard(data)
        freed.wait(PATIENCE_S)

    local.subscribe(keys.EVENT, slow)
    until_heard(remote, keys.EVENT, heard)
    sent = [b"%d" % number for number in range(200)]
    for data in sent:
        remote.send(keys.EVENT, data)
    freed.set()
    assert heard.wait(lambda items: items[-1] == sent[-1])
    assert [data for data in heard.items if data != b"hello"] == sent


def test_a_slow_receiver_does_not_hold_up_another_channel(ends):
    remote, local = ends
    freed, blocked, stopped = threading.Event(), Collected(), Collected()

    def block(data: bytes) -> None:
        blocked(data)
        freed.wait(PATIENCE_S)

    remote.subscribe(keys.HEARTBEAT, block)
    remote.serve(keys.MODEL, lambda _request: block(b"model"))
    remote.subscribe(keys.STOP, stopped)
    until_heard(local, keys.STOP, stopped)
    until_heard(local, keys.HEARTBEAT, blocked)
    answered = threading.Event()
    local.ask(keys.MODEL, b"model", 1.0, lambda _answer: answered.set())
    for _ in range(400):
        local.send(keys.HEARTBEAT, b"alive")
    local.send(keys.STOP, b"stop")
    assert stopped.wait(lambda items: b"stop" in items)
    assert local.ask_and_wait(keys.LEASE, b"?", PATIENCE_S) == b"here"
    assert blocked.items.count(b"alive") == 0
    freed.set()
    assert answered.wait(PATIENCE_S)


def test_a_handler_that_fails_does_not_end_its_channel(ends, caplog):
    remote, local = ends
    heard = Collected()

    def fail_first(data: bytes) -> None:
        heard(data)
        if data == b"bad":
            raise ValueError("this one is bad")

    local.subscribe(keys.EVENT, fail_first)
    until_heard(remote, keys.EVENT, heard)
    remote.send(keys.EVENT, b"bad")
    remote.send(keys.EVENT, b"good")
    assert heard.wait(lambda items: b"good" in items)
    assert "could not be handled" in caplog.text


def test_a_message_of_the_largest_size_crosses_whole(ends):
    remote, local = ends
    remote.serve(keys.MODEL, lambda request: request.answer(request.data))
    largest = bytes(range(256)) * (MAX_BYTES // 256)
    answer = None
    while answer is None:
        answer = local.ask_and_wait(keys.MODEL, largest, PATIENCE_S)
    assert answer == largest


def test_a_port_in_use_is_one_line_that_names_it():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    first = ZenohLink(EndpointSettings(listen=endpoint))
    with pytest.raises(LinkError) as caught:
        ZenohLink(EndpointSettings(listen=endpoint))
    first.close()
    assert endpoint in str(caught.value) and "in use" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("field", ["listen", "connect"])
@pytest.mark.parametrize(
    "endpoint", ["nonsense", "tcp/", "tcp/127.0.0.1:port", "pigeon/127.0.0.1:1", "tcp/::1:7447"]
)
def test_an_endpoint_that_is_not_understood_is_refused_with_its_field_and_an_example(field, endpoint):
    with pytest.raises(
        ValueError, match=rf"^{field}: tcp/, .*such as tcp/127.0.0.1:7447 .*got '{endpoint}'$"
    ):
        EndpointSettings(**{field: endpoint})


@pytest.mark.parametrize(
    "endpoint", ["tcp/203.0.113.1:7447", "udp/203.0.113.1:7447", "tcp/no.such.host.invalid:7447"]
)
def test_an_endpoint_of_another_machine_is_not_said_to_be_in_use(endpoint):
    with pytest.raises(LinkError, match=f"{endpoint}: .*choose an address of this machine") as caught:
        ZenohLink(EndpointSettings(listen=endpoint))
    assert "in use" not in str(caught.value) and "\n" not in str(caught.value)


def test_the_end_takes_all_threads_along():
    before = set(threading.enumerate())
    link = ZenohLink(EndpointSettings(listen=f"tcp/127.0.0.1:{free_port()}"))
    link.subscribe(keys.STOP, lambda _: None)
    link.serve(keys.COMMAND, lambda _: None)
    assert len(set(threading.enumerate()) - before) >= 8
    link.close()
    link.close()
    assert not [thread for thread in set(threading.enumerate()) - before if thread.is_alive()]


PROGRAM = """
import sys
from farhand.common.wire import keys
from farhand.common.wire.messages import MAX_BYTES
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
remote = ZenohLink(EndpointSettings(listen=sys.argv[1]))
local = ZenohLink(EndpointSettings(connect=sys.argv[1]))
remote.serve(keys.LEASE, lambda request: request.answer(b"here"))
remote.subscribe(keys.STOP, print)
while local.ask_and_wait(keys.LEASE, b"?", 5.0) is None:
    pass
local.send(keys.STOP, b"stop")
local.close()
remote.close()
"""


def test_an_interpreter_with_closed_links_exits():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    subprocess.run([sys.executable, "-c", PROGRAM, endpoint], check=True, timeout=60)
