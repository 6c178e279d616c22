"""A client that is no browser: it can press what is disabled and send what no slider sends."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager

import msgspec
import pytest
import viser
import zstandard
from playwright.sync_api import expect
from viser import _messages
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin, Subprotocol

from tests.browser.conftest import NewTab
from tests.browser.operator_page import WAIT_MS, OperatorPage
from tests.browser.stack import Stack

PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")


class RawClient:
    """Speaks the page's protocol, with no page."""

    def __init__(self, connection: Connection):
        self._connection = connection
        self._uuids: dict[str, str] = {}
        self._send(
            _messages.ViewerCameraMessage(
                (1.0, 0.0, 0.0, 0.0),
                (0.0, 0.0, 5.0),
                0.35,
                0.1,
                50.0,
                560,
                900,
                (0.0, 0.0, 0.0),
                (0.0, 1.0, 0.0),
            )
        )

    def press(self, label: str) -> None:
        self.set(label, value=True)

    def set(self, label: str, **attributes: object) -> None:
        self._send(_messages.GuiUpdateMessage(self._uuid(label), attributes))

    def _uuid(self, label: str) -> str:
        """The element of this label, from the messages that make the page."""
        while label not in self._uuids:
            data = self._connection.recv(WAIT_MS * 1e-3)
            assert isinstance(data, bytes)
            size = int.from_bytes(data[8:16], "little")
            content = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(data[16 : 16 + size]))
            for message in content["messages"]:
                if "label" in message.get("props", {}):
                    self._uuids[message["props"]["label"]] = message["uuid"]
        return self._uuids[label]

    def _send(self, message: _messages.Message) -> None:
        self._connection.send(msgspec.msgpack.encode(message.as_serializable_dict()))


def raw_connection(stack: Stack, origin: Origin | None = None) -> AbstractContextManager[Connection]:
    """To the page's socket; what comes is kept until it is read, so that pings are answered."""
    return connect(
        stack.address.replace("http", "ws"), origin=origin, subprotocols=[PROTOCOL], max_size=None,
        max_queue=None, ping_interval=None,
    )  # fmt: skip


@pytest.fixture
def raw(stack: Stack) -> Iterator[RawClient]:
    """A raw client that came first: it is the one that may act."""
    with raw_connection(stack) as connection:
        yield RawClient(connection)


@pytest.fixture
def watching(raw: RawClient, new_tab: NewTab) -> OperatorPage:
    """A tab that shows what became of it."""
    tab = new_tab()
    tab.says("session", "watching")
    return tab


def test_a_raw_client_cannot_do_what_the_table_of_modes_forbids(
    raw: RawClient, watching: OperatorPage
) -> None:
    for label in ("Execute", "Couple", "Abort", "Reset", "Clutch", "Preview"):
        assert watching.button(label).is_disabled()
        raw.press(label)
        watching.tells(f"{label.lower()}: refused: {label.lower()} is not allowed in DISARMED")
    watching.says("mode", "DISARMED")
    watching.says("pending", "none")


def test_what_lies_outside_a_slider_is_clamped(raw: RawClient, watching: OperatorPage) -> None:
    for value, clamped in ((-5.0, "0"), (1e12, "3000"), (float("nan"), "0")):
        raw.set("One-way delay [ms]", value=value)
        expect(watching.slider("One-way delay [ms]")).to_have_value(clamped, timeout=WAIT_MS)
    watching.says("mode", "DISARMED")


def test_nobody_can_take_the_stop_button_away(raw: RawClient, watching: OperatorPage) -> None:
    for attribute in ({"removed": True}, {"update_cb": []}, {"value": True, "is_button": False}):
        raw.set("STOP", **attribute)
    watching.command("STOP", "STOPPED")
    raw.press("Reset")
    watching.says("mode", "DISARMED")


def test_a_page_of_another_web_site_is_turned_away(stack: Stack) -> None:
    with (
        raw_connection(stack, Origin("http://evil.example")) as connection,
        pytest.raises(ConnectionClosed) as closed,
    ):
        while True:
            connection.recv(WAIT_MS * 1e-3)
    assert closed.value.rcvd is not None and closed.value.rcvd.code == 1008
