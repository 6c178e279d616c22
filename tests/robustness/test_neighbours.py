"""Whoever reaches the robot's port: what a stranger may not do, and how little one who reads nothing matters."""

from __future__ import annotations

import contextlib
import itertools
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import zenoh

from farhand.common.address import endpoint_address, free_port
from farhand.common.link import session
from farhand.common.link.endpoint import EndpointSettings, zenoh_configuration
from farhand.common.link.link import ZenohLink
from farhand.common.mode_table import ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import MAX_BYTES, encode
from farhand.common.wire.messages import (
    ExecutionReport,
    Heartbeat,
    ReportRequest,
    Stop,
    StopAck,
    Telemetry,
)
from farhand.evaluation.harness.farhand_process import HeardProcess
from tests.robustness.neighbours import VEHICLE, RawPeer
from tests.robustness.raw_operator import SESSION, RawOperator

OF_THE_ROBOT = [channel for channel in keys.ALL if not channel.is_to_robot]
OF_OPERATORS = [channel for channel in keys.ALL if channel.is_to_robot]
TELEMETRY = f"{VEHICLE}/{keys.TELEMETRY.key}"
_numbers = itertools.count(1)


@pytest.fixture
def stranger(robot: HeardProcess, endpoint: str) -> Iterator[RawPeer]:
    peer = RawPeer(endpoint)
    peer.listen(TELEMETRY)
    peer.until_it_hears(TELEMETRY)  # it is connected, and hears what it may
    yield peer
    peer.close()


def operate(operator: RawOperator) -> None:
    """Send on every kind of key, and have every question answered."""
    for seq in range(5):
        operator.link.send(keys.HEARTBEAT, encode(Heartbeat(session=SESSION, seq=seq, echo=None)))
        operator.link.send(keys.STOP, encode(Stop(stop_id=f"theirs {next(_numbers)}", site_name="tester")))
        operator.ask(keys.REPORT, ReportRequest(), ExecutionReport)
    operator.bring_to_hold()


@pytest.mark.parametrize(
    "key",
    [
        f"{VEHICLE}/op/**",
        f"{VEHICLE}/**",
        "**",
        "*/op/*/*",
        f"{VEHICLE}/op/operator/hb",
        f"{VEHICLE}/op/*/stop",
        f"{VEHICLE}/*/*/cmd",
    ],
)
def test_a_stranger_reads_nothing_that_operators_send(key, stranger, operator):
    stranger.listen(key)
    operate(operator)
    stranger.until_it_hears(TELEMETRY)
    assert not [heard for heard in stranger.heard if "/op/" in heard]


@pytest.mark.parametrize("key", ["op/operator/cmd", "op/*/lease", "op/*/report", "op/**", "**"])
def test_a_stranger_takes_no_question_of_an_operator(key, stranger, operator):
    stranger.serve(f"{VEHICLE}/{key}" if key != "**" else key)
    operate(operator)
    assert not stranger.asked


@pytest.mark.parametrize("channel", OF_THE_ROBOT, ids=lambda channel: channel.key)
def test_a_stranger_cannot_speak_for_the_robot(channel, stranger, operator):
    """Not by a message, not by an answer to a question, not by a deletion."""
    heard: list[bytes] = []
    operator.link.subscribe(channel, heard.append)
    forged = b"forged"
    for priority in (zenoh.Priority.REAL_TIME, zenoh.Priority.DATA_LOW):
        for block in (zenoh.CongestionControl.BLOCK, zenoh.CongestionControl.DROP):
            for express in (True, False):
                stranger.session.put(
                    f"{VEHICLE}/{channel.key}",
                    forged,
                    priority=priority,
                    congestion_control=block,
                    express=express,
                )
    stranger.session.delete(f"{VEHICLE}/{channel.key}")
    operate(operator)
    operator.report()
    assert forged not in heard and b"" not in heard


def test_a_stranger_cannot_claim_that_the_robot_stands_while_it_does_not(stranger, operator):
    stop, heard = Stop(stop_id=f"mine {next(_numbers)}", site_name="tester"), []
    operator.link.subscribe(keys.STOP_ACK, heard.append)
    stamp = operator.report().stamp
    stranger.session.put(
        f"{VEHICLE}/{keys.STOP_ACK.key}", encode(StopAck(stop_id=stop.stop_id, standing=True, stamp=stamp))
    )
    fake = Telemetry(
        seq=10**9, stamp=stamp, mode=ControlMode.STOPPED, position_m=(0.0, 0.0), frame_origin_m=(0.0, 0.0)
    )
    stranger.session.put(TELEMETRY, encode(fake))
    operate(operator)
    assert operator.report().seq < 10**9
    assert encode(fake) not in heard
    assert not [ack for ack in heard if stop.stop_id.encode() in ack]


def test_a_stranger_may_still_stop_the_robot_and_ask_for_the_lease(stranger, operator):
    stranger.session.put(
        f"{VEHICLE}/{keys.STOP.of('stranger')}",
        encode(Stop(stop_id=f"stranger {next(_numbers)}", site_name="stranger")),
    )
    operator.report(lambda told: told.mode is ControlMode.STOPPED)
    (answer,) = stranger.ask(f"{VEHICLE}/{keys.REPORT.of('stranger')}", encode(ReportRequest()))
    assert answer


def test_without_the_access_list_the_same_stranger_reads_takes_and_forges(monkeypatch):
    """So the tests above can fail."""

    def unguarded(settings: EndpointSettings) -> dict[str, Any]:
        return {key: part for key, part in zenoh_configuration(settings).items() if key != "access_control"}

    monkeypatch.setattr(session, "zenoh_configuration", unguarded)
    endpoint, heard, over = f"tcp/127.0.0.1:{free_port()}", [], threading.Event()
    robot = ZenohLink(EndpointSettings(listen=endpoint))
    robot.subscribe(keys.STOP, lambda _: None)
    robot.serve(keys.REPORT, lambda request: request.answer(b"the robot's"))
    operator, stranger = ZenohLink(EndpointSettings(connect=endpoint)), RawPeer(endpoint)

    def take(data: bytes) -> None:
        heard.append(data)
        over.set()

    try:
        operator.subscribe(keys.TELEMETRY, take)
        stranger.listen(f"{VEHICLE}/op/**")
        stranger.serve(f"{VEHICLE}/{keys.REPORT.of('*')}")
        _until(over, lambda: stranger.session.put(TELEMETRY, b"forged"))
        assert heard[0] == b"forged"
        deadline_s = time.monotonic() + 60.0
        while not (stranger.heard and stranger.asked):
            assert time.monotonic() < deadline_s
            operator.send(keys.STOP, b"stop")
            operator.ask_and_wait(keys.REPORT, b"", 5.0)
    finally:
        for end in (operator, stranger, robot):
            end.close()


# The size of messages ----------------------------------------------------------------------------


def resident_kb(pid: int) -> int:
    (line,) = (
        line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("VmRSS")
    )
    return int(line.split()[1])


@pytest.mark.parametrize("send", ["put", "get"])
def test_a_message_of_300_mb_is_never_put_together(send, stranger, robot, operator):
    before_kb, huge = resident_kb(robot.pid), bytes(300_000_000)
    seen_kb, over = [before_kb], threading.Event()

    def watch() -> None:
        while not over.wait(0.02):
            seen_kb.append(resident_kb(robot.pid))

    watching = threading.Thread(target=watch)
    watching.start()
    if send == "put":
        stranger.session.put(f"{VEHICLE}/op/model", huge, congestion_control=zenoh.CongestionControl.BLOCK)
    else:
        stranger.ask(f"{VEHICLE}/op/model", huge)
    operate(operator)
    over.set()
    watching.join()
    assert max(seen_kb) - before_kb < 100_000
    largest = bytes(MAX_BYTES)
    assert operator.ask_raw(keys.MODEL, largest) is None  # arrives, and is no message
    assert robot.running


def test_what_anybody_needs_to_send_fits(operator):
    """The bounds are those of the keys: what they take, the transport carries."""
    got: list[bytes] = []
    arrived = threading.Event()

    def deliver(data: bytes) -> None:
        got.append(data)
        arrived.set()

    endpoint = f"tcp/127.0.0.1:{free_port()}"
    there = ZenohLink(EndpointSettings(listen=endpoint))
    here = ZenohLink(EndpointSettings(connect=endpoint))
    try:
        there.subscribe(keys.MODEL, deliver)
        _until(arrived, lambda: here.send(keys.MODEL, bytes(keys.MODEL.most_bytes)))
        assert len(got[0]) == keys.MODEL.most_bytes
    finally:
        here.close()
        there.close()


def _until(arrived: threading.Event, again: Callable[[], None]) -> None:
    """A message that is sent before the other side has subscribed goes nowhere."""
    deadline_s = time.monotonic() + 60.0
    while not arrived.wait(0.2):
        assert time.monotonic() < deadline_s
        again()


@pytest.mark.parametrize(
    "word", [b"", b"GET / HTTP/1.1\r\nHost: robot\r\nX-Slow: ", b"\xff\xff\x00", b"\x02\x00\x01"]
)
def test_idle_connections_straight_to_the_robots_port_keep_no_operator_out(
    word: bytes, robot, endpoint, operator
):
    """Who says nothing, or begins something and never ends it, costs a descriptor and nobody's control."""
    host, port = endpoint_address(endpoint)
    idle = [socket.create_connection((host, port)) for _ in range(300)]
    try:
        for each in idle:
            with contextlib.suppress(OSError):
                each.sendall(word)
        newcomer = ZenohLink(EndpointSettings(connect=endpoint))
        heard = threading.Event()
        newcomer.subscribe(keys.TELEMETRY, lambda _: heard.set())
        assert heard.wait(30.0), "a new operator hears nothing of the robot"
        stop = Stop(stop_id=f"beside idle ones {word!r}", site_name="newcomer")
        for _ in range(300):  # as a site does: it is sent again until the robot stands
            newcomer.send(keys.STOP, encode(stop))
            if operator.report().mode is ControlMode.STOPPED:
                break
        assert operator.report().mode is ControlMode.STOPPED
        newcomer.close()
        assert robot.running
    finally:
        for each in idle:
            each.close()
