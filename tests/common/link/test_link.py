"""Over real sessions of the transport, on free ports of this machine."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable, Iterator

import pytest

from farhand.common.address import free_port
from farhand.common.errors import LinkError
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.interface import Request
from farhand.common.link.link import ZenohLink
from farhand.common.wire import keys
from farhand.common.wire.messages import MAX_BYTES

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
def remote_endpoint() -> str:
    return f"tcp/127.0.0.1:{free_port()}"


@pytest.fixture
def ends(remote_endpoint: str) -> Iterator[tuple[ZenohLink, ZenohLink]]:
    """The remote end, which listens, and the local end, which has found it."""
    remote = ZenohLink(EndpointSettings(listen=remote_endpoint))
    local = ZenohLink(EndpointSettings(connect=remote_endpoint))
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


def test_a_message_of_the_largest_size_of_its_key_is_delivered_and_a_larger_one_is_not_read(ends):
    remote, local = ends
    heard = Collected()
    remote.subscribe(keys.STOP, heard)
    until_heard(local, keys.STOP, heard)
    local.send(keys.STOP, bytes(keys.STOP.most_bytes + 1))
    local.send(keys.STOP, bytes(keys.STOP.most_bytes))
    assert heard.wait(lambda items: len(items[-1]) == keys.STOP.most_bytes)
    assert max(map(len, heard.items)) == keys.STOP.most_bytes


def test_a_question_larger_than_its_key_allows_is_not_handed_over(ends):
    remote, local = ends
    asked = Collected()

    def handle(request: Request) -> None:
        asked(request.data)
        request.answer(b"here")

    remote.serve(keys.COMMAND, handle)
    while local.ask_and_wait(keys.COMMAND, b"?", PATIENCE_S) != b"here":
        pass
    assert local.ask_and_wait(keys.COMMAND, bytes(keys.COMMAND.most_bytes + 1), PATIENCE_S) is None
    assert set(asked.items) == {b"?"}


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


@pytest.fixture
def others(ends: tuple[ZenohLink, ZenohLink], remote_endpoint: str) -> Iterator[list[ZenohLink]]:
    """More local ends of the same remote one."""
    links = [ZenohLink(EndpointSettings(connect=remote_endpoint)) for _ in range(4)]
    for link in links:
        while link.ask_and_wait(keys.LEASE, b"are you there?", 5.0) != b"here":
            pass
    yield links
    for link in links:
        link.close()


def test_a_receiver_that_blocks_holds_up_no_other_connection(ends, others):
    remote, local = ends
    freed, blocked, stopped = threading.Event(), Collected(), Collected()

    def block(data: bytes) -> None:
        blocked(data)
        freed.wait(PATIENCE_S)

    remote.subscribe(keys.HEARTBEAT, block)
    remote.serve(keys.MODEL, lambda _request: block(b"model"))
    remote.subscribe(keys.STOP, stopped)
    until_heard(local, keys.STOP, stopped)
    for link in others:  # more than the transport has threads by default
        link.ask(keys.MODEL, b"model", 1.0, lambda _answer: None)
        link.send(keys.HEARTBEAT, b"alive")
    assert blocked.wait(lambda items: len(items) >= len(others))
    local.send(keys.STOP, b"stop")
    assert stopped.wait(lambda items: b"stop" in items)
    assert local.ask_and_wait(keys.LEASE, b"?", PATIENCE_S) == b"here"
    assert not freed.is_set()
    freed.set()


def test_who_sends_what_is_not_wanted_is_read_slowly_and_loses_nothing_of_anybody(ends, others):
    remote, local = ends
    heard, n = Collected(), 1000

    def judge(data: bytes) -> bool:
        heard(data)
        return not data.startswith(b"unwanted")

    remote.subscribe(keys.STOP, judge)
    until_heard(local, keys.STOP, heard)
    for number in range(n):
        for link in others:
            link.send(keys.STOP, b"unwanted %d" % number)
    for number in range(20):
        local.send(keys.STOP, b"wanted %d" % number)
    assert heard.wait(lambda items: b"wanted 19" in items)
    among = list(heard.items)
    assert [data for data in among if data.startswith(b"wanted")] == [b"wanted %d" % k for k in range(20)]
    assert sum(data.startswith(b"unwanted") for data in among) < n  # of 4000
    assert heard.wait(lambda items: sum(data.startswith(b"unwanted") for data in items) == n * len(others))


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
    largest, heard = bytes(range(256)) * (MAX_BYTES // 256), Collected()
    local.subscribe(keys.EVENT, heard)
    until_heard(remote, keys.EVENT, heard)
    remote.send(keys.EVENT, largest)
    assert heard.wait(lambda items: items[-1] == largest)


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
        ZenohLink(EndpointSettings(listen=endpoint, insecure=True))
    assert "in use" not in str(caught.value) and "\n" not in str(caught.value)


def test_the_end_takes_all_threads_along():
    before = set(threading.enumerate())
    link = ZenohLink(EndpointSettings(listen=f"tcp/127.0.0.1:{free_port()}"))
    link.subscribe(keys.STOP, lambda _: None)
    link.serve(keys.COMMAND, lambda _: None)
    assert len(set(threading.enumerate()) - before) >= 6
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
