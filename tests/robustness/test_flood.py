"""A flood of garbage on every key: the robot still hears its operator and does its task."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import msgpack
import numpy as np
import pytest

from farhand.common.link.link import EndpointSettings, ZenohLink
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.model.model_file import content_hash
from farhand.common.model.model_file import encode as encode_model
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import (
    SCHEMA,
    Command,
    Event,
    Heartbeat,
    LeaseRequest,
    ModelReply,
    ModelTransfer,
    MoveTarget,
    OperatorInput,
    Stamp,
    Stop,
    StopAck,
    Telemetry,
)
from farhand.evaluation.harness.bad_neighbours import MODELS
from farhand.evaluation.harness.farhand_process import HeardProcess
from tests.remote_site.planar import short_strokes
from tests.robustness.raw_operator import PATIENCE_S, SESSION, RawOperator

CHANNELS = (keys.STOP, keys.INPUT, keys.HEARTBEAT, keys.TARGET)
BURST, PAUSE_S = 100, 0.01
_numbers = itertools.count(1)
GARBAGE = (
    np.random.default_rng(0).bytes(200),
    msgpack.packb({"schema": SCHEMA + 1, "stop_id": "theirs"}) or b"",
    msgpack.packb({"schema": SCHEMA, "stop_id": 5, "session": [], "seq": "one"}) or b"",
    msgpack.packb([0] * 100_000) or b"",
)
COMMAND = Command(
    command_id="theirs", session="a stranger", lease_id="a stranger's", action=Action.ARM, echo=None
)


class Flood:
    """Others who send what nobody understands, or nobody wants, as fast as they are read.

    Args:
        endpoint: The robot's.
        act: Sends once, over one connection.
        n: Number of connections.
    """

    def __init__(self, endpoint: str, act: Callable[[ZenohLink], None], n: int):
        self._links = [ZenohLink(EndpointSettings(connect=endpoint)) for _ in range(n)]
        self._act, self._over = act, threading.Event()
        self._threads = [
            threading.Thread(target=self._run, args=(link,), daemon=True) for link in self._links
        ]
        for thread in self._threads:
            thread.start()

    def end(self) -> None:
        self._over.set()
        for thread in self._threads:
            thread.join(30.0)
        for link in self._links:
            link.close()

    def _run(self, link: ZenohLink) -> None:
        while not self._over.wait(PAUSE_S):
            self._act(link)


def send_garbage(link: ZenohLink) -> None:
    """Send garbage on every key of messages: random bytes, another version, fields that are wrong, and far too much."""
    for channel in CHANNELS:
        for garbage in GARBAGE:
            for _ in range(BURST // len(GARBAGE)):
                link.send(channel, garbage)


@pytest.fixture
def flood(endpoint: str, operator: RawOperator, robot: HeardProcess) -> Iterator[Flood]:
    flood = Flood(endpoint, send_garbage, 3)
    while "dropped: " not in robot.words:
        operator.report()
    yield flood
    flood.end()


def test_under_a_flood_of_garbage_each_stop_arrives_though_it_is_sent_only_once(operator, flood):
    acknowledged, all_of_them = set[str](), threading.Event()
    sent = {f"once {number}" for number in range(100)}

    def hear(data: bytes) -> None:
        acknowledged.add(decode(data, StopAck).stop_id)
        if acknowledged >= sent:
            all_of_them.set()

    operator.link.subscribe(keys.STOP_ACK, hear)
    for stop_id in sorted(sent):
        operator.send(keys.STOP, Stop(stop_id=stop_id, site_name="tester"))
        operator.report()
    assert all_of_them.wait(PATIENCE_S), sorted(sent - acknowledged)


def hand(operator: RawOperator) -> OperatorInput:
    return OperatorInput(
        seq=1,
        echo=operator.report().stamp,
        lease_id=operator.lease_id,
        coupling_id=10**6,
        position_m=(0.1, 0.2),
    )


def move_target(operator: RawOperator) -> MoveTarget:
    long_ago = Stamp(boot="another boot", t_ns=1)
    return MoveTarget(echo=long_ago, lease_id=operator.lease_id, position_m=(0.1, 0.2))


@pytest.mark.parametrize(("channel", "message"), [(keys.INPUT, hand), (keys.TARGET, move_target)])
def test_under_a_flood_of_garbage_each_message_is_counted_though_it_is_sent_only_once(
    channel, message, operator, flood
):
    """Without a coupling, or of another boot: each is refused, and the robot says how many it refused."""
    before = operator.report()
    for _ in range(50):
        operator.send(channel, message(operator))
        operator.report()
    operator.report(lambda told: told.stale_refused == before.stale_refused + 50)


def ask_for_the_lease(link: ZenohLink) -> None:
    """Send well-formed requests and heartbeats, of which none is the holder's."""
    asked = encode(LeaseRequest(session="a stranger", site_name="stranger"))
    for _ in range(BURST):
        link.ask(keys.LEASE, asked, 5.0, lambda _answer: None)
        link.ask(keys.COMMAND, encode(COMMAND), 5.0, lambda _answer: None)
        link.send(keys.HEARTBEAT, encode(Heartbeat(session="a stranger", seq=1, echo=None)))
    answered = threading.Event()  # more would only wait in its own memory
    link.ask(keys.LEASE, asked, 5.0, lambda _answer: answered.set())
    answered.wait(5.0)


def test_under_a_flood_of_requests_in_order_each_command_is_answered_though_it_is_asked_only_once(
    operator, endpoint
):
    flood = Flood(endpoint, ask_for_the_lease, 3)
    try:
        for seq in itertools.islice(_numbers, 30):
            assert operator.command(Action.DISARM).accepted
            assert operator.command(Action.ARM).accepted
            heartbeat = Heartbeat(session=SESSION, seq=seq, echo=operator.report().stamp)
            operator.send(keys.HEARTBEAT, heartbeat)
            operator.report(lambda told, seq=seq: told.heartbeat_echo == seq)
    finally:
        flood.end()


def test_a_flood_of_garbage_stops_neither_the_heartbeat_nor_the_execution(operator, robot, flood):
    before_bytes = resident_bytes(robot.pid)
    content = encode_model(short_strokes())
    transfer = ModelTransfer(session=SESSION, task="planar", sha256=content_hash(content), content=content)
    assert operator.ask(keys.MODEL, transfer, ModelReply).accepted
    reply = operator.command(Action.EXECUTE, model_sha256=transfer.sha256)
    assert reply.accepted, reply.reason
    operator.report(lambda told: told.phase is Phase.APPROACHING)
    for seq in itertools.islice(_numbers, 50):
        heartbeat = Heartbeat(session=SESSION, seq=seq, echo=operator.report().stamp)
        # One may be replaced or dropped; its sender sends more.
        while operator.report().heartbeat_echo != seq:
            operator.link.send(keys.HEARTBEAT, encode(heartbeat))
    operator.report(lambda told: told.phase is Phase.ARRIVED)
    assert "dropped: " in robot.words
    assert robot.running
    assert resident_bytes(robot.pid) - before_bytes < 100e6


def resident_bytes(pid: int) -> int:
    """Return the memory that a process holds [B]."""
    (line,) = [
        line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("VmRSS")
    ]
    return 1024 * int(line.split()[1])


@pytest.mark.parametrize("what", MODELS)
def test_models_from_somebody_without_the_lease_delay_neither_reports_nor_a_stop(
    operator: RawOperator, robot: HeardProcess, endpoint: str, what: str
):
    stranger, over = ZenohLink(EndpointSettings(connect=endpoint)), threading.Event()
    stamps: list[int] = []
    operator.link.subscribe(keys.TELEMETRY, lambda data: stamps.append(decode(data, Telemetry).stamp.t_ns))
    before, before_bytes = operator.report(), resident_bytes(robot.pid)
    sending = threading.Thread(target=MODELS[what], args=(stranger, over), daemon=True)
    try:
        sending.start()
        for _ in range(50):
            operator.report()
        operator.send(keys.STOP, Stop(stop_id=f"under a flood of {what}", site_name="tester"))
        now = operator.report(lambda told: told.mode is ControlMode.STOPPED)
    finally:
        over.set()
        stranger.close()
    sending.join(120.0)
    # The robot's own clock in its reports: no control period was left out for longer than a busy machine's pause.
    gaps_s = 1e-9 * np.diff(np.array(stamps))
    assert now.stamp.boot == before.stamp.boot and gaps_s.max() < 0.5, gaps_s.max()
    assert now.model == before.model and resident_bytes(robot.pid) - before_bytes < 100e6


def test_a_flood_of_stops_costs_no_memory_and_its_events_are_counted(
    operator: RawOperator, robot: HeardProcess, endpoint: str
):
    stranger = ZenohLink(EndpointSettings(connect=endpoint))
    events: list[Event] = []
    operator.link.subscribe(keys.EVENT, lambda data: events.append(decode(data, Event)))
    before_bytes = resident_bytes(robot.pid)
    try:
        for number in range(5_000):
            stranger.send(keys.STOP, encode(Stop(stop_id=f"flood {number}", site_name="stranger")))
        operator.report(lambda told: told.mode is ControlMode.STOPPED)
        for number in range(100):  # what is in order is still heard at once
            operator.send(keys.STOP, Stop(stop_id=f"after the flood {number}", site_name="tester"))
        operator.report()
    finally:
        stranger.close()
    assert sum(event.who == "stranger" for event in events) <= 200
    assert resident_bytes(robot.pid) - before_bytes < 100e6
