"""Encrypted links over real QUIC connections, through the real relay, with certificates of a real authority."""

from __future__ import annotations

import asyncio
import shutil
import threading
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from farhand.common.address import free_port
from farhand.common.errors import InvalidConfiguration, LinkError
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.common.wire import keys
from farhand.deploy.link.relay import Relay
from farhand.deploy.pki.registry import Registry

HOST = "127.0.0.1"
PATIENCE_S = 60.0
N = 60
BAD = DirectionSettings(delay_ms=20, jitter_ms=10, loss=10, duplicate=10, corrupt=5, seed=1)


class RelayThread:
    """The relay in a thread of its own."""

    def __init__(self, target_port: int, settings: LinkSettings):
        self._loop = asyncio.new_event_loop()
        self._ready, self._end = threading.Event(), asyncio.Event()
        self._thread = threading.Thread(
            target=self._loop.run_until_complete, args=(self._run(target_port, settings),)
        )
        self._thread.start()
        assert self._ready.wait(PATIENCE_S)

    async def _run(self, target_port: int, settings: LinkSettings) -> None:
        self._relay = Relay((HOST, 0), (HOST, target_port), settings)
        await self._relay.start()
        self.port = self._relay.address[1]
        self._ready.set()
        await self._end.wait()
        await self._relay.stop()

    def do(self, what: Callable[[Relay], object]) -> object:
        """Do something with the relay in its own thread."""

        async def done() -> object:
            return what(self._relay)

        return asyncio.run_coroutine_threadsafe(done(), self._loop).result(PATIENCE_S)

    def close(self) -> None:
        self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join()
        self._loop.close()


@pytest.fixture(scope="module")
def registry(tmp_path_factory: pytest.TempPathFactory) -> Registry:
    registry = Registry.create(tmp_path_factory.mktemp("pki") / "pki", "fleet")
    registry.issue("rov1", "robot", (HOST,), 30)
    registry.issue("shore-1", "operator", (), 30)
    return registry


@pytest.fixture
def robot(registry: Registry) -> Iterator[tuple[ZenohLink, int]]:
    """The robot's end, which answers lease requests, and its port."""
    port = free_port("quic")
    link = ZenohLink(
        EndpointSettings(listen=f"quic/{HOST}:{port}", certificates=str(registry.folder_of("rov1")))
    )
    link.serve(keys.LEASE, lambda request: request.answer(request.data[::-1]))
    yield link, port
    link.close()


def operator(folder: Path, port: int) -> ZenohLink:
    return ZenohLink(EndpointSettings(connect=f"quic/{HOST}:{port}", certificates=str(folder)))


def ask_until_answered(link: ZenohLink, data: bytes = b"abc") -> bytes:
    while (answer := link.ask_and_wait(keys.LEASE, data, PATIENCE_S)) is None:
        pass  # an unconnected question is answered with nothing at once
    return answer


class Heard:
    """What arrived on a channel."""

    def __init__(self, link: ZenohLink, channel: keys.Channel):
        self.items: list[int] = []
        self._changed = threading.Condition()
        link.subscribe(channel, self._take)

    def _take(self, data: bytes) -> None:
        with self._changed:
            self.items.append(int.from_bytes(data[:4], "big"))
            self._changed.notify_all()

    def until(self, holds: Callable[[list[int]], bool], timeout_s: float = PATIENCE_S) -> bool:
        with self._changed:
            return self._changed.wait_for(lambda: holds(self.items), timeout_s)


def test_both_ends_ask_answer_and_send_over_one_encrypted_connection(registry: Registry, robot):
    there, port = robot
    here = operator(registry.folder_of("shore-1"), port)
    try:
        assert ask_until_answered(here) == b"cba"
        stops, reports = Heard(there, keys.STOP), Heard(here, keys.TELEMETRY)
        while not (stops.until(bool, 0.05) and reports.until(bool, 0.05)):
            here.send(keys.STOP, bytes(4))
            there.send(keys.TELEMETRY, bytes(300))
    finally:
        here.close()


def test_what_must_arrive_does_once_and_in_order_over_a_link_that_loses_doubles_and_corrupts(
    registry: Registry, robot
):
    there, port = robot
    relay = RelayThread(port, LinkSettings(uplink=BAD, downlink=BAD))
    here = operator(registry.folder_of("shore-1"), relay.port)
    try:
        ask_until_answered(here)
        events, reports = Heard(here, keys.EVENT), Heard(here, keys.TELEMETRY)
        while not (events.until(bool, 0.05) and reports.until(bool, 0.05)):
            there.send(keys.EVENT, bytes(4))
            there.send(keys.TELEMETRY, bytes(300))
        for k in range(1, N + 1):
            there.send(keys.EVENT, k.to_bytes(4, "big"))
            there.send(keys.TELEMETRY, k.to_bytes(4, "big") + bytes(260))
            if k == N // 2:
                relay.do(Relay.rebind)  # goes on from another port under the connection
            assert here.ask_and_wait(keys.LEASE, b"%d" % k, PATIENCE_S) == (b"%d" % k)[::-1]
        assert events.until(lambda items: N in items)
        arrived = [k for k in events.items if k]
        assert arrived == list(range(1, N + 1))
        newest = [k for k in reports.items if k]
        assert newest == sorted(set(newest))
        assert len(newest) > N / 4
        status = relay.do(Relay.status)
        assert isinstance(status, dict)
        assert (status["connections"], status["rebinds"]) == (1, 1)
        assert status["downlink"]["datagrams"]["lost"] > 0
    finally:
        here.close()
        relay.close()


def test_a_cut_of_twelve_seconds_is_over_soon_after_its_end(registry: Registry, robot):
    """Without `SilenceGate` the first report comes about as long after the cut as the cut was."""
    there, port = robot
    slow = DirectionSettings(delay_ms=50)
    relay = RelayThread(port, LinkSettings(uplink=slow, downlink=slow))
    here = operator(registry.folder_of("shore-1"), relay.port)
    ended = threading.Event()

    def send() -> None:
        while not ended.wait(0.04):
            there.send(keys.TELEMETRY, bytes(264))
            here.send(keys.HEARTBEAT, bytes(40))

    sender = threading.Thread(target=send)
    try:
        ask_until_answered(here)
        reports, heartbeats = Heard(here, keys.TELEMETRY), Heard(there, keys.HEARTBEAT)
        sender.start()
        assert reports.until(lambda items: len(items) > 25)
        assert heartbeats.until(lambda items: len(items) > 25)
        relay.do(lambda relay: relay.outage("blackhole", 12.0))
        while relay.do(lambda relay: relay.status()["outage"]["kind"]) != "none":
            ended.wait(0.05)
        before = len(reports.items)
        assert reports.until(lambda items: len(items) > before, 5.0)
    finally:
        ended.set()
        sender.join()
        here.close()
        relay.close()


def test_who_has_another_authority_or_dials_another_name_is_not_answered_and_the_right_one_is(
    tmp_path: Path, registry: Registry, robot
):
    _, port = robot
    stranger = Registry.create(tmp_path / "pki", "fleet").issue("shore-1", "operator", (), 30)
    strangers = [operator(stranger, port)]
    mixed = tmp_path / "mixed"  # trusts the robot, and shows a certificate that the robot does not trust
    shutil.copytree(stranger, mixed)
    ca = registry.folder_of("rov1") / "ca.pem"
    with pytest.raises(InvalidConfiguration, match="issued by the authority"):
        shutil.copy(ca, mixed / "ca.pem")
        operator(mixed, port)
    by_name = EndpointSettings(
        connect=f"quic/localhost:{port}", certificates=str(registry.folder_of("shore-1"))
    )
    strangers.append(ZenohLink(by_name))  # the robot's certificate has the address alone
    here = operator(registry.folder_of("shore-1"), port)
    try:
        assert ask_until_answered(here) == b"cba"
        for link in strangers:
            assert link.ask_and_wait(keys.LEASE, b"abc", 1.0) is None
    finally:
        for link in (*strangers, here):
            link.close()


def test_an_operators_certificate_does_not_pass_for_a_robots(registry: Registry):
    port = free_port("quic")
    false = ZenohLink(
        EndpointSettings(listen=f"quic/{HOST}:{port}", certificates=str(registry.folder_of("shore-1")))
    )
    false.serve(keys.LEASE, lambda request: request.answer(b"I am the robot"))
    here = operator(registry.folder_of("shore-1"), port)
    try:
        for _ in range(20):
            assert here.ask_and_wait(keys.LEASE, b"abc", 0.1) is None
    finally:
        here.close()
        false.close()


def test_a_site_with_an_expired_certificate_says_so_and_does_not_try(tmp_path: Path):
    then = datetime.now(UTC) - timedelta(days=100)
    folder = Registry.create(tmp_path / "pki", "fleet", then).issue("shore-1", "operator", (), 90, then)
    with pytest.raises(LinkError, match=r"certificate of shore-1 expired on .*: farhand pki renew shore-1"):
        operator(folder, free_port("quic"))


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"connect": "quic/127.0.0.1:1"}, r"certificates: the folder that `farhand pki` made"),
        ({"listen": "tls/127.0.0.1:1"}, r"certificates: the folder that `farhand pki` made"),
        ({"connect": "tcp/127.0.0.1:1", "certificates": "x"}, r"connect: quic/ or tls/ and HOST:PORT"),
    ],
)
def test_encryption_is_asked_for_wholly_or_not_at_all(fields: dict[str, Any], words: str):
    with pytest.raises(ValueError, match=words):
        EndpointSettings(**fields)


def test_a_folder_without_certificates_is_named(tmp_path: Path):
    with pytest.raises(InvalidConfiguration, match=r"certificate\.pem: a readable file"):
        operator(tmp_path, free_port("quic"))
