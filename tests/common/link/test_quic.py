"""Encrypted links over real QUIC connections, through the real relay, with certificates of a real authority."""

from __future__ import annotations

import subprocess
import sys
import threading
import time

import pytest

from farhand.common.address import free_port
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.link import budget
from farhand.common.link.interface import Request
from farhand.common.link.link import ZenohLink
from farhand.common.wire import keys
from farhand.deploy.link.relay import Relay
from farhand.deploy.pki.registry import Registry
from tests.common.link.encrypted import HOST, Heard, RelayThread, ask_until_answered, operator

PATIENCE_S = 60.0
N = 60
BAD = DirectionSettings(delay_ms=20, jitter_ms=10, loss=10, duplicate=10, corrupt=5, seed=1)


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
    registry: Registry, robot, monkeypatch: pytest.MonkeyPatch
):
    # No silence counts as an outage here: what arrives while fresh connections take over may arrive on both.
    monkeypatch.setattr(budget, "_LEAST_SILENCE_S", 60.0)
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
            assert ask_until_answered(here, b"%d" % k) == (b"%d" % k)[::-1]
        assert events.until(lambda items: N in items)
        arrived = [k for k in events.items if k]
        assert arrived == list(range(1, N + 1))
        newest = [k for k in reports.items if k]
        assert newest == sorted(set(newest))
        assert len(newest) > N / 4
        status = relay.do(Relay.status)
        assert isinstance(status, dict)
        assert (status["connections"], status["rebinds"]) == (3, 1)  # one each for streams and stops
        assert status["downlink"]["datagrams"]["lost"] > 0
    finally:
        here.close()
        relay.close()


def test_two_cuts_of_nine_seconds_are_over_soon_after_their_ends(registry: Registry, robot):
    """Without `SilenceGate` the first report comes about as long after the cut as the cut was.

    After the first cut fresh connections take the place of those whose window it wore out, without a gap.
    """
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
        for n_cuts in (1, 2):
            relay.do(lambda relay: relay.outage("blackhole", 9.0))
            while relay.do(lambda relay: relay.status()["outage"]["kind"]) != "none":
                ended.wait(0.05)
            before = len(reports.items)
            assert reports.until(lambda items, n=before: len(items) > n, 5.0)
            until_s = time.monotonic() + PATIENCE_S
            while min(session.renewed for session in here._sessions._all) < n_cuts:
                assert time.monotonic() < until_s
                ended.wait(0.05)
            assert ask_until_answered(here, b"abc") == b"cba"
            before = len(heartbeats.items)
            assert heartbeats.until(lambda items, n=before: len(items) > n)
        assert not any(session.reopened for session in here._sessions._all)
    finally:
        ended.set()
        sender.join()
        here.close()
        relay.close()


def test_a_link_that_is_opened_again_in_place_goes_on_asking_hearing_and_answering(registry: Registry, robot):
    there, port = robot
    here = operator(registry.folder_of("shore-1"), port)
    try:
        ask_until_answered(here)
        stops, reports = Heard(there, keys.STOP), Heard(here, keys.TELEMETRY)
        for k, link in enumerate((there, here, there), start=1):
            link.reopen()
            assert ask_until_answered(here) == b"cba"
            while not (
                stops.until(lambda items, k=k: k in items, 0.05)
                and reports.until(lambda items, k=k: k in items, 0.05)
            ):
                here.send(keys.STOP, k.to_bytes(4, "big"))
                there.send(keys.TELEMETRY, k.to_bytes(4, "big") + bytes(260))
    finally:
        here.close()


def test_on_a_lossy_link_a_command_is_handled_once_and_answered_while_the_stream_would_still_wait(
    registry: Registry, robot
):
    there, port = robot
    bad = DirectionSettings(delay_ms=20, loss=20, duplicate=20, seed=2)
    relay = RelayThread(port, LinkSettings(uplink=bad, downlink=bad))
    here = operator(registry.folder_of("shore-1"), relay.port)
    handled: list[bytes] = []

    def handle(request: Request) -> None:
        handled.append(request.data)
        request.answer(request.data)

    try:
        there.serve(keys.COMMAND, handle)
        ask_until_answered(here)
        for k in range(12):
            command = b"command %d" % k
            while here.ask_and_wait(keys.COMMAND, command, PATIENCE_S) != command:
                handled.clear()  # it was not connected, or not served yet
        assert len(handled) == len(set(handled)) == 12
    finally:
        here.close()
        relay.close()


def test_an_answer_ends_the_silence_so_that_the_next_question_is_asked_at_once(registry: Registry, robot):
    _, port = robot
    here = operator(registry.folder_of("shore-1"), port)
    try:
        ask_until_answered(here)
        begun_s, answers = time.monotonic(), []
        while time.monotonic() - begun_s < 1.5:  # nothing but answers is heard for longer than a silence
            answers.append(here.ask_and_wait(keys.LEASE, b"abc", PATIENCE_S))
        # A busy machine may be silent now and then; if answers did not count, nearly all would be dropped.
        assert answers.count(b"cba") > 0.9 * len(answers)
    finally:
        here.close()


@pytest.mark.parametrize("dead", ["_stops", "main"])
def test_a_stop_arrives_and_is_acknowledged_though_one_of_its_two_connections_is_dead(
    registry: Registry, robot, dead: str
):
    there, port = robot
    here = operator(registry.folder_of("shore-1"), port)
    try:
        ask_until_answered(here)
        stops, acknowledged = Heard(there, keys.STOP), Heard(here, keys.STOP_ACK)
        assert here._probe is not None
        here._probe.close()  # else it would be replaced at once
        getattr(here._sessions, dead)._session.close()
        here.send(keys.STOP, bytes(4))
        assert stops.until(bool)
        assert _acknowledge(there, acknowledged)
    finally:
        here.close()


def _acknowledge(robot: ZenohLink, acknowledged: Heard) -> bool:
    until_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < until_s:
        robot.send(keys.STOP_ACK, bytes(4))
        if acknowledged.until(bool, 0.1):
            return True
    return False


PROGRAM = """
import sys, threading
from farhand.common.link import budget
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.common.wire import keys
robot, operator, endpoint = sys.argv[1:]
right = keys.RIGHT.of("shore-1")
there = ZenohLink(EndpointSettings(listen=endpoint, certificates=robot))
here = ZenohLink(EndpointSettings(connect=endpoint, certificates=operator))
while not here._sessions.answers(right, 5.0, lambda: False):
    pass
here._sessions.renew(right, 5.0, lambda: False)
there.close()
here._sessions.renew(right, 0.3, lambda: False)
here.close()
"""


def test_an_interpreter_whose_connections_are_still_being_closed_ends_in_order(registry: Registry):
    """As daemons, the threads that close them would abort it ("exception not rethrown")."""
    folders = (registry.issue("rov7", "robot", (HOST,), 30), registry.folder_of("shore-1"))
    endpoint = f"quic/{HOST}:{free_port('quic')}"
    subprocess.run([sys.executable, "-c", PROGRAM, *map(str, folders), endpoint], check=True, timeout=120)
