"""docs/protocol.md says what the code says."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest

from docs.protocol_page import FLOWS, PAGE, meaning, page
from docs.protocol_words import ERRORS, SHARED_FIELDS
from farhand.common.clock import BootClock
from farhand.common.link.interface import Answered
from farhand.common.task import TaskSet
from farhand.common.wire import keys
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import Message
from farhand.local_site.console.console import Console
from farhand.local_site.teaching.library import Library
from farhand.remote_site.camera.robot_camera import RobotCamera
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.robot import Robot
from tests.messages import all_kinds
from tests.remote_site.planar import TASK

ROOT = Path(__file__).parent.parent


class Spy:
    """A link that notes who listens to what."""

    def __init__(self) -> None:
        self.kinds: dict[Channel, type[Message]] = {}
        self.served: set[Channel] = set()

    def subscribe(self, channel: Channel, deliver: Callable[[bytes], bool | None]) -> None:
        self.kinds[channel] = deliver.args[0] if isinstance(deliver, functools.partial) else Message

    def serve(self, channel: Channel, handle: Any) -> None:
        self.kinds[channel] = handle.args[0]
        self.served.add(channel)

    def send(self, channel: Channel, data: bytes) -> None:
        raise AssertionError("nothing is sent")

    def ask(self, channel: Channel, data: bytes, timeout_s: float, answered: Answered) -> None:
        raise AssertionError("nothing is asked")

    def limit(self, channel: Channel, bytes_per_s: float) -> None:
        pass

    def close(self) -> None:
        pass


def test_the_page_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == page(), "run: python -m docs.protocol_page"


def test_every_key_and_every_message_is_on_the_page_once():
    assert [flow.channel for flow in FLOWS] == list(keys.ALL)
    kinds = [kind for flow in FLOWS for kind in (flow.sent, flow.answered) if kind is not None]
    assert sorted(kinds, key=lambda kind: kind.__name__) == all_kinds()


def test_the_robot_listens_to_what_the_page_says_goes_to_it():
    spy = Spy()
    Robot(
        RemoteConfig(),
        TaskSet([TASK]),
        BootClock(),
        spy,
        lambda request: None,
        lambda **fields: None,
        None,
    )
    RobotCamera(spy, BootClock(), 0.0, None)
    to_robot = [flow for flow in FLOWS if flow.channel.key.startswith("op/")]
    assert spy.kinds == {flow.channel: flow.sent for flow in to_robot}
    assert spy.served == {flow.channel for flow in to_robot if flow.answered is not None}


def test_a_console_listens_to_what_the_page_says_comes_from_the_robot(tmp_path: Path):
    spy = Spy()
    Console(Library(TaskSet([TASK]), tmp_path), spy, "ann").listen()
    assert set(spy.kinds) == {flow.channel for flow in FLOWS if flow.channel.key.startswith("rov/")}


@pytest.mark.parametrize("kind", all_kinds(), ids=lambda kind: kind.__name__)
def test_every_field_has_a_meaning(kind: type[Message]):
    assert not [field.name for field in msgspec.structs.fields(kind) if not meaning(kind, field.name)]


def test_no_words_are_left_over():
    names = {field.name for kind in all_kinds() for field in msgspec.structs.fields(kind)}
    assert set(SHARED_FIELDS) <= names


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: error[1])
def test_every_error_is_said_by_the_code(error: tuple[str, str, str, str, str]):
    assert error[1] in (ROOT / error[4]).read_text(encoding="utf-8")
