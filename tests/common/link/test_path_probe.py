"""The probe of a path: answered by a real robot's port, and connecting again once that is reachable, or another connection works."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator

import pytest

from farhand.common.address import free_port
from farhand.common.impairment.impairment import LinkSettings
from farhand.common.link import budget
from farhand.common.link.budget import Silence
from farhand.common.link.endpoint import EndpointSettings, zenoh_configuration
from farhand.common.link.link import ZenohLink
from farhand.common.link.path_probe import Path, PathProbe, probe
from farhand.common.wire import keys
from farhand.deploy.link.relay import Relay
from farhand.deploy.pki.registry import Registry
from tests.common.link.encrypted import HOST, PATIENCE_S, Heard, RelayThread

LEAST_S = 0.1
"""Usual silence in the tests over TCP [s], so that they take a fifth of the time of a real link."""


def path_to(endpoint: str) -> Path:
    """A path over QUIC."""
    settings = EndpointSettings(connect=endpoint, certificates="unread")
    return Path.of(settings, zenoh_configuration, keys.RIGHT.of("shore-1"), Silence())


def test_a_robots_port_answers_the_probe(robot):
    _, port = robot
    assert probe(("127.0.0.1", port), 0.4, threading.Event(), patience_s=30.0) is not None


def test_a_port_where_nothing_or_something_else_answers_does_not():
    with socket.socket(type=socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        address = other.getsockname()
        done = threading.Event()

        def answer() -> None:
            while not done.is_set():
                data, sender = other.recvfrom(2048)
                other.sendto(data[:20], sender)  # an echo is no answer

        thread = threading.Thread(target=answer, daemon=True)
        thread.start()
        assert probe(address, 0.1, threading.Event(), patience_s=0.5) is None
        done.set()
        with socket.socket(type=socket.SOCK_DGRAM) as last:
            last.sendto(b"end", address)
        thread.join()
    assert probe(address, 0.1, threading.Event(), patience_s=0.5) is None


@pytest.mark.parametrize(("answers", "connects_again"), [(False, True), (True, False)])
def test_a_connection_that_carries_no_answer_on_an_open_path_is_made_anew(
    robot, answers: bool, connects_again: bool
):
    _, port = robot
    asked, again, silent_s = threading.Event(), threading.Event(), 60.0

    def answer(*_: object) -> bool:
        asked.set()
        return answers

    watch = PathProbe(path_to(f"quic/127.0.0.1:{port}"), lambda: silent_s, lambda: True, answer, again.set)
    try:
        assert asked.wait(30.0)
        assert again.wait(30.0 if connects_again else 3.0) is connects_again
    finally:
        watch.close()


def test_a_connection_is_made_as_soon_as_the_path_is_there(robot):
    _, port = robot
    again = threading.Event()
    watch = PathProbe(
        path_to(f"quic/127.0.0.1:{port}"), lambda: 0.0, again.is_set, lambda *_: False, again.set
    )
    try:
        assert again.wait(30.0)
    finally:
        watch.close()


@pytest.mark.parametrize("survives", [True, False])
def test_after_an_outage_a_connection_that_brings_nothing_is_made_anew_and_one_that_survived_is_kept(
    monkeypatch: pytest.MonkeyPatch, survives: bool
):
    silent, over, again = [60.0], threading.Event(), threading.Event()
    paths = iter((None, None))  # the path is cut for two attempts, then open

    def probed(*_: object) -> float | None:
        if (found := next(paths, 0.01)) is not None:
            silent[0] = 0.0 if survives else silent[0]
            over.set()
        return found

    monkeypatch.setattr("farhand.common.link.path_probe.probe", probed)
    watch = PathProbe(
        path_to("quic/127.0.0.1:1"), lambda: silent[0], lambda: True, lambda *_: False, again.set
    )
    try:
        assert over.wait(30.0)
        assert again.wait(3.0 if survives else 30.0) is not survives
    finally:
        watch.close()


@pytest.mark.parametrize("is_silent", [True, False])
def test_where_a_connection_can_stand_beside_a_dead_one_that_is_replaced_heard_or_not(
    robot, monkeypatch: pytest.MonkeyPatch, is_silent: bool
):
    """One that is idle, as that of stops, may be dead while the others are heard."""
    monkeypatch.setattr("farhand.common.link.path_probe._CHECK_S", 0.2)
    _, port = robot
    beside, again = threading.Event(), threading.Event()
    watch = PathProbe(
        path_to(f"quic/127.0.0.1:{port}"), lambda: 60.0 if is_silent else 0.0, lambda: True, lambda *_: False,
        again.set, lambda _timeout_s, _gives_up: beside.set(),
    )  # fmt: skip
    try:
        assert beside.wait(30.0)
        assert not again.is_set()
    finally:
        watch.close()


def test_connections_that_answer_are_left_alone(robot, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("farhand.common.link.path_probe._CHECK_S", 0.2)
    _, port = robot
    asked, changed = threading.Semaphore(0), threading.Event()

    def answer(*_: object) -> bool:
        asked.release()
        return True

    watch = PathProbe(
        path_to(f"quic/127.0.0.1:{port}"), lambda: 0.0, lambda: True, answer,
        changed.set, lambda _timeout_s, _gives_up: changed.set(),
    )  # fmt: skip
    try:
        assert all(asked.acquire(timeout=30.0) for _ in range(3))
        assert not changed.is_set()
    finally:
        watch.close()


def test_a_first_attempt_over_a_long_path_is_not_begun_again_before_it_can_succeed(
    monkeypatch: pytest.MonkeyPatch,
):
    """At 1 s one way an opening takes eight seconds; an attempt begun again after three never ended."""
    monkeypatch.setattr("farhand.common.link.path_probe._UNCONNECTED_S", 0.2)
    monkeypatch.setattr("farhand.common.link.path_probe.probe", lambda *_: 0.2)
    again, began_s = threading.Event(), time.monotonic()
    watch = PathProbe(path_to("quic/127.0.0.1:1"), lambda: 0.0, again.is_set, lambda *_: True, again.set)
    try:
        assert again.wait(30.0)
        assert time.monotonic() - began_s > 1.5 + 7.0 * 0.2 - 0.1
    finally:
        watch.close()


class Talk:
    """A robot that reports all the time, and an operator's site that is connected to it through the relay."""

    def __init__(self, scheme: str, registry: Registry):
        def certificates(name: str) -> str:
            return str(registry.folder_of(name)) if scheme == "tls" else ""

        robots = f"{scheme}/{HOST}:{free_port()}"
        self._robot = ZenohLink(EndpointSettings(listen=robots, certificates=certificates("rov1")))
        self.relay = RelayThread(int(robots.rpartition(":")[2]), LinkSettings())
        mine = EndpointSettings(
            connect=f"{scheme}/{HOST}:{self.relay.port}", certificates=certificates("shore-1")
        )
        self.operator = ZenohLink(mine)
        self._over = threading.Event()
        self._reporting = threading.Thread(target=self._report)
        self._reporting.start()
        self.reports = Heard(self.operator, keys.TELEMETRY)
        assert self.reports.until(bool)

    def hears_news(self) -> bool:
        """Wait for a report that is sent from now on."""
        newest = self._n
        return self.reports.until(lambda items: items[-1] > newest)

    @property
    def accepted(self) -> int:
        status = self.relay.do(Relay.status)
        assert isinstance(status, dict)
        return status["accepted"]

    @property
    def reopened(self) -> int:
        return self.operator._sessions.main.reopened

    def close(self) -> None:
        self._over.set()
        self._reporting.join()
        self.operator.close()
        self._robot.close()
        self.relay.close()

    def _report(self) -> None:
        self._n = 0
        while not self._over.wait(0.02):
            self._n += 1
            self._robot.send(keys.TELEMETRY, self._n.to_bytes(4, "big") + bytes(260))


@pytest.fixture(params=["tcp", "tls"])
def talk(
    request: pytest.FixtureRequest, registry: Registry, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Talk]:
    monkeypatch.setattr(budget, "_LEAST_SILENCE_S", LEAST_S)
    talk = Talk(request.param, registry)
    yield talk
    talk.close()


def test_a_tcp_connection_that_a_nat_has_forgotten_is_made_anew_long_before_the_transports_lease_ends(
    talk: Talk,
):
    began_s = time.monotonic()
    talk.relay.do(Relay.rebind)
    assert talk.hears_news()
    assert talk.reopened >= 1
    assert time.monotonic() - began_s < EndpointSettings().lease_s / 2


def test_a_tcp_connection_survives_an_outage_of_thirty_usual_silences(talk: Talk):
    outage_s, before = 30.0 * LEAST_S, talk.accepted
    talk.relay.do(lambda relay: relay.outage("stall", outage_s))
    began_s = time.monotonic()
    assert talk.hears_news()
    assert time.monotonic() - began_s > 0.8 * outage_s
    assert (
        talk.accepted > before
    )  # another connection was tried meanwhile, and the old one brought the first message
    assert talk.reopened == 0


def test_a_site_that_hears_nothing_from_a_robot_that_answers_keeps_its_connection():
    """Such as one that has subscribed to nothing: the robot's end of the link answers all the same."""
    asked, answered = threading.Event(), []

    def answer(timeout_s: float, gives_up: Callable[[], bool]) -> bool:
        answered.append(link._sessions.answers(keys.RIGHT.of("operator"), timeout_s, gives_up))
        asked.set()
        return answered[-1]

    endpoint = f"tcp/{HOST}:{free_port()}"
    robot, link = ZenohLink(EndpointSettings(listen=endpoint)), ZenohLink(EndpointSettings(connect=endpoint))
    again = threading.Event()
    settings = EndpointSettings(connect=endpoint)
    path = Path.of(settings, zenoh_configuration, keys.RIGHT.of("operator"), Silence())
    watch = PathProbe(path, lambda: 60.0, lambda: link._sessions.is_connected, answer, again.set)
    try:
        assert asked.wait(PATIENCE_S)
        assert answered == [True]
        assert not again.wait(1.0)
    finally:
        for part in (watch, link, robot):
            part.close()


def test_on_an_acoustic_link_neither_rare_reports_nor_a_slow_handshake_are_taken_for_a_dead_connection():
    settings, key = EndpointSettings(connect="tcp/127.0.0.1:1", rate_bps=9600.0), keys.RIGHT.of("operator")
    narrow = Path.of(settings, zenoh_configuration, key, Silence(9600.0))
    wide = Path.of(settings, zenoh_configuration, key, Silence())
    report_s, one_way_s = (264 + 70) / (0.45 * 9600.0 / 8.0), 0.67
    assert narrow.doubted_s > 10.0 * report_s
    assert narrow.answer_s > 4.0 * one_way_s
    assert narrow.unconnected_s > 5.0 * 4.0 * one_way_s
    assert wide.doubted_s <= 3.0
