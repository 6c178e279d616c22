"""A flood of garbage on every key: the robot still hears its operator and does its task."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator
from pathlib import Path

import msgpack
import numpy as np
import pytest

from farhand.common.control_mode import Action, ControlMode, Phase
from farhand.common.link.link import EndpointSettings, ZenohLink
from farhand.common.model.model_file import content_hash
from farhand.common.model.model_file import encode as encode_model
from farhand.common.model.tphsmm import MAX_COMPONENTS
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import SCHEMA, Event, Heartbeat, ModelReply, ModelTransfer, Stop, Telemetry
from tests.farhand_process import FarhandProcess
from tests.remote_site.planar import cyclic, short_strokes
from tests.robustness.raw_operator import SESSION, RawOperator

CHANNELS = (keys.STOP, keys.INPUT, keys.HEARTBEAT, keys.TARGET)
BURST, PAUSE_S = 100, 0.01


class Flood:
    """Somebody else who sends what nobody understands, as fast as they can."""

    def __init__(self, endpoint: str):
        self._link = ZenohLink(EndpointSettings(connect=endpoint))
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def end(self) -> None:
        self._over.set()
        self._thread.join(30.0)
        self._link.close()

    def _run(self) -> None:
        garbage = np.random.default_rng(0).bytes(200)
        while not self._over.wait(PAUSE_S):
            for channel in CHANNELS:
                for _ in range(BURST):
                    self._link.send(channel, garbage)


@pytest.fixture
def flood(endpoint: str, operator: RawOperator) -> Iterator[Flood]:
    flood = Flood(endpoint)
    yield flood
    flood.end()


def test_a_flood_of_garbage_stops_neither_the_heartbeat_nor_the_execution(operator, robot, flood):
    before_bytes = resident_bytes(robot.pid)
    content = encode_model(short_strokes())
    transfer = ModelTransfer(session=SESSION, task="planar", sha256=content_hash(content), content=content)
    assert operator.ask(keys.MODEL, transfer, ModelReply).accepted
    reply = operator.command(Action.EXECUTE, model_sha256=transfer.sha256)
    assert reply.accepted, reply.reason
    operator.report(lambda told: told.phase is Phase.APPROACHING)
    for seq in range(1, 11):
        heartbeat = Heartbeat(session=SESSION, seq=seq, echo=operator.report().stamp)
        operator.link.send(keys.HEARTBEAT, encode(heartbeat))
        operator.report(lambda told, seq=seq: told.heartbeat_echo == seq)
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


def wide_model() -> bytes:
    """Return the bytes of a valid model with the most components."""
    return encode_model(cyclic(MAX_COMPONENTS))


@pytest.mark.parametrize("what", ["3.8 MB of nothing", "parts of 2 MB", "the widest model"])
def test_models_from_somebody_without_the_lease_delay_neither_reports_nor_a_stop(
    operator: RawOperator, robot: FarhandProcess, endpoint: str, what: str
):
    content = {"3.8 MB of nothing": bytes(3_800_000), "parts of 2 MB": bytes(1_900_000)}.get(
        what
    ) or wide_model()
    size = 2_000_000 if what == "parts of 2 MB" else 0
    stranger = ZenohLink(EndpointSettings(connect=endpoint))
    stamps: list[int] = []
    operator.link.subscribe(keys.TELEMETRY, lambda data: stamps.append(decode(data, Telemetry).stamp.t_ns))
    before, before_bytes = operator.report(), resident_bytes(robot.pid)
    answers: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
    try:
        for number in range(100):
            sha256 = f"{number:064x}" if what != "the widest model" else content_hash(content)
            sent = {
                "schema": SCHEMA,
                "task": "planar",
                "session": "stranger",
                "sha256": sha256,
                "size": size,
                "content": content,
            }
            stranger.ask(keys.MODEL, msgpack.packb(sent) or b"", 30.0, answers.put)
        operator.send(keys.STOP, Stop(stop_id=f"under a flood of {what}", site_name="tester"))
        operator.report(lambda told: told.mode is ControlMode.STOPPED)
        replies = [answers.get(timeout=120.0) for _ in range(100)]
    finally:
        stranger.close()
    accepted = [decode(reply, ModelReply) for reply in replies if reply is not None]
    assert not any(reply.accepted for reply in accepted)
    now = operator.report()
    # The robot's own clock in its reports: no control period was left out for longer than a busy machine's pause.
    gaps_s = 1e-9 * np.diff(np.array(stamps))
    assert now.stamp.boot == before.stamp.boot and gaps_s.max() < 0.5, gaps_s.max()
    assert resident_bytes(robot.pid) - before_bytes < 100e6


def test_a_flood_of_stops_costs_no_memory_and_its_events_are_counted(
    operator: RawOperator, robot: FarhandProcess, endpoint: str
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
