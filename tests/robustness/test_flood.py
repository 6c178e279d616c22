"""A flood of garbage on every key: the robot still hears its operator and does its task."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import numpy as np
import pytest

from farhand.common.control_mode import Action, Phase
from farhand.common.link.link import EndpointSettings, ZenohLink
from farhand.common.model.model_file import content_hash
from farhand.common.model.model_file import encode as encode_model
from farhand.common.wire import keys
from farhand.common.wire.codec import encode
from farhand.common.wire.messages import Heartbeat, ModelReply, ModelTransfer
from tests.robustness.raw_operator import SESSION, RawOperator
from tests.strategies import learned

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
    content = encode_model(learned())
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
