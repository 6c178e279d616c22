"""A site whose messages are of another version: refused by name on both sides, but for its STOP."""

from __future__ import annotations

from pathlib import Path

import msgpack
import pytest
from msgspec import structs

from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import (
    SCHEMA,
    LeaseRequest,
    Message,
    Stop,
    StopAck,
)
from farhand.common.wire.reasons import Code
from farhand.evaluation.harness.farhand_process import HeardProcess
from farhand.local_site.console.facts import operator_facts
from farhand.local_site.console.intent_permission import command_refusal
from farhand.local_site.view.panels.words.advice import advice
from farhand.local_site.view.panels.words.status import lease_words
from tests.local_site.robot_end import desk
from tests.robustness.raw_operator import RawOperator

NEWER = SCHEMA + 1


def of_another_version(message: Message) -> bytes:
    return encode(structs.replace(message, schema=NEWER))


def test_the_robot_answers_no_site_of_another_version_and_says_why(
    robot: HeardProcess, operator: RawOperator
):
    asked = of_another_version(LeaseRequest(session="newer", site_name="newer"))
    assert operator.ask_raw(keys.LEASE, asked) is None
    assert operator.ask_raw(keys.COMMAND, of_another_version(operator.new_command(Action.DISARM))) is None
    assert operator.report().mode is ControlMode.HOLD
    while (
        f"LeaseRequest: schema: version {SCHEMA}, got {NEWER}: run the same Farhand on both sites"
        not in robot.words
    ):
        operator.ask_raw(keys.LEASE, asked)


def test_a_stop_of_another_version_stops_the_robot_and_is_acknowledged(operator: RawOperator):
    acks: list[StopAck] = []
    operator.link.subscribe(keys.STOP_ACK, lambda data: acks.append(decode(data, StopAck)))
    operator.link.send(keys.STOP, of_another_version(Stop(stop_id="newer", site_name="newer")))
    operator.report(lambda told: told.mode is ControlMode.STOPPED)
    operator.report(lambda _: any(ack.stop_id == "newer" and ack.standing for ack in acks))


def test_the_operators_site_says_that_the_robot_is_of_another_version_and_sends_it_nothing_but_stops(
    tmp_path: Path,
):
    with desk(tmp_path) as it:
        report = it.robot.report()
        plain = msgpack.unpackb(encode(report)) | {"v": NEWER}
        assert it.until(lambda p: p.robot is not None)

        def of_newer() -> None:
            it.robot._link.send(keys.TELEMETRY, msgpack.packb(plain) or b"")

        of_newer()
        picture = it.until(lambda p: bool(p.other_schema))
        assert f"version {SCHEMA}, got {NEWER}" in picture.other_schema
        assert "another version" in advice(picture) and lease_words(picture) == "another version"
        for action in set(Action) - {Action.STOP}:
            reason = command_refusal(action, picture)
            assert reason is not None and reason.code == Code.OTHER_VERSION
        assert operator_facts(it.console, "", None).not_understood == picture.other_schema


@pytest.mark.parametrize("action", [Action.STOP])
def test_a_stop_is_pressed_whatever_the_version(tmp_path: Path, action: Action):
    with desk(tmp_path) as it:
        it.robot._link.send(keys.TELEMETRY, msgpack.packb({"v": NEWER}) or b"")
        picture = it.until(lambda p: bool(p.other_schema))
        assert command_refusal(action, picture) is None
