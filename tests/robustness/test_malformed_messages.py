"""Malformed messages to a real robot process: each is dropped, the robot goes on as if none had come."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest

from farhand.common.mode_table import Action, ControlMode
from farhand.common.model.model_file import content_hash
from farhand.common.model.model_file import encode as encode_model
from farhand.common.wire import keys
from farhand.common.wire.codec import encode
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import (
    BlobReply,
    BlobRequest,
    CatalogueReply,
    CatalogueRequest,
    CommandReply,
    ExecutionReport,
    Heartbeat,
    LeaseReply,
    LeaseRequest,
    Message,
    ModelReply,
    ModelTransfer,
    MoveTarget,
    OperatorInput,
    ReportRequest,
    Stop,
    Telemetry,
)
from farhand.evaluation.harness.farhand_process import HeardProcess
from tests.remote_site.planar import short_strokes
from tests.robustness.malformed import malformed
from tests.robustness.raw_operator import SESSION, RawOperator

_numbers = itertools.count(1)


def model_transfer(content: bytes) -> ModelTransfer:
    return ModelTransfer(session=SESSION, task="planar", sha256=content_hash(content), content=content)


STREAMS: dict[Channel, Callable[[RawOperator], Message]] = {
    keys.STOP: lambda o: Stop(stop_id=f"stop {next(_numbers)}", site_name="tester"),
    keys.INPUT: lambda o: OperatorInput(
        seq=next(_numbers), echo=o.report().stamp, lease_id=o.lease_id, coupling_id=1, position_m=(0.1, 0.2)
    ),
    keys.HEARTBEAT: lambda o: Heartbeat(session=SESSION, seq=next(_numbers), echo=o.report().stamp),
    keys.TARGET: lambda o: MoveTarget(echo=o.report().stamp, lease_id=o.lease_id, position_m=(0.2, 0.8)),
}
QUESTIONS: dict[Channel, Callable[[RawOperator], Message]] = {
    keys.COMMAND: lambda o: o.new_command(Action.DISARM),
    keys.LEASE: lambda o: LeaseRequest(session="another", site_name="another"),
    keys.MODEL: lambda o: model_transfer(encode_model(short_strokes())),
    keys.REPORT: lambda o: ReportRequest(),
    keys.CATALOGUE: lambda o: CatalogueRequest(),
    keys.BLOB: lambda o: BlobRequest(sha256="0" * 64, n_bytes=1000),
}
ANSWERS = {
    keys.COMMAND: CommandReply, keys.LEASE: LeaseReply, keys.MODEL: ModelReply, keys.REPORT: ExecutionReport,
    keys.CATALOGUE: CatalogueReply, keys.BLOB: BlobReply,
}  # fmt: skip


def state(report: Telemetry) -> tuple:
    """What only a message that counts may change."""
    return (
        report.mode, report.phase, report.position_m, report.model, report.coupling_id, report.path_id,
        report.holder, report.lease, report.heartbeat_echo, report.stale_refused,
    )  # fmt: skip


def is_well(operator: RawOperator) -> None:
    operator.ask(keys.REPORT, ReportRequest(), ExecutionReport)


def until_the_robot_says(robot: HeardProcess, text: str, again: Callable[[], object]) -> None:
    """Its log names the same trouble once a second at most."""
    while text not in robot.words:
        again()


@pytest.mark.parametrize("channel", STREAMS, ids=lambda channel: channel.key)
def test_a_malformed_message_is_dropped_with_its_reason_and_changes_nothing(channel, robot, operator):
    message = STREAMS[channel](operator)
    before = state(operator.report())
    for data in malformed(message):
        operator.link.send(channel, data)
        is_well(operator)
    assert state(operator.report()) == before
    until_the_robot_says(
        robot, f"dropped: {type(message).__name__}: ", lambda: send_and_wait(operator, channel)
    )


def send_and_wait(operator: RawOperator, channel: Channel) -> None:
    operator.link.send(channel, b"\xc1")
    operator.report()


@pytest.mark.parametrize("channel", QUESTIONS, ids=lambda channel: channel.key)
def test_a_malformed_question_gets_no_answer_and_changes_nothing(channel, robot, operator):
    message = QUESTIONS[channel](operator)
    before = state(operator.report())
    for data in malformed(message):
        assert operator.ask_raw(channel, data) is None
        is_well(operator)
    assert state(operator.report()) == before

    def again() -> None:
        operator.ask_raw(channel, b"\xc1")
        operator.report()

    until_the_robot_says(robot, f"not answered: {type(message).__name__}: ", again)


# The same messages unharmed: they do count, so it was their form that kept the others out.


def test_a_wellformed_stop_stops(operator):
    operator.link.send(keys.STOP, encode(STREAMS[keys.STOP](operator)))
    operator.report(lambda told: told.mode is ControlMode.STOPPED)


def test_a_wellformed_input_of_an_old_coupling_is_counted_as_stale(operator):
    before = operator.report().stale_refused
    operator.link.send(keys.INPUT, encode(STREAMS[keys.INPUT](operator)))
    operator.report(lambda told: told.stale_refused == before + 1)


def test_a_wellformed_heartbeat_is_echoed(operator):
    heartbeat = STREAMS[keys.HEARTBEAT](operator)
    assert isinstance(heartbeat, Heartbeat)
    operator.link.send(keys.HEARTBEAT, encode(heartbeat))
    operator.report(lambda told: told.heartbeat_echo == heartbeat.seq)


def test_a_wellformed_target_moves(operator):
    assert operator.report().frame_origin_m[1] < 0.5
    operator.link.send(keys.TARGET, encode(STREAMS[keys.TARGET](operator)))
    operator.report(lambda told: told.frame_origin_m[1] > 0.7)


@pytest.mark.parametrize("channel", QUESTIONS, ids=lambda channel: channel.key)
def test_a_wellformed_question_is_answered(channel, operator):
    operator.ask(channel, QUESTIONS[channel](operator), ANSWERS[channel])
