"""Speaks the page's protocol without a page."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from typing import Any

import msgspec
import numpy as np
import viser
import zstandard
from numpy.typing import NDArray
from viser import _messages
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin, Subprotocol

SUBPROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
CAMERA = _messages.ViewerCameraMessage(
    (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 5.0), 0.35, 0.1, 50.0, 560, 900, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)
)
"""What a tab sends first: it counts as open from then on."""
_PATIENCE_S = 60.0


def raw_connection(address: str, origin: str | None = None) -> AbstractContextManager[Connection]:
    """To the page's socket; what comes is kept until it is read, so that pings are answered."""
    return connect(
        address.replace("http", "ws"), origin=Origin(origin) if origin else None, subprotocols=[SUBPROTOCOL], max_size=None, max_queue=None,
        ping_interval=None, close_timeout=1.0,
    )  # fmt: skip


class RawClient:
    """One client.

    Args:
        connection: See `raw_connection`.
    """

    def __init__(self, connection: Connection):
        self._connection = connection
        self.uuids: dict[str, str] = {}
        """Of the elements that have been sent, by their labels."""
        self.n_bytes = 0
        """Received so far."""
        self.send(CAMERA)

    def uuid(self, label: str) -> str:
        """The element with a label, once it was sent."""
        while label not in self.uuids:
            self.receive()
        return self.uuids[label]

    def press(self, label: str) -> None:
        """Press a button, whether it may be pressed or not."""
        self.set(label, value=True)

    def set(self, label: str, **attributes: object) -> None:
        """Set attributes of an element."""
        self.send(_messages.GuiUpdateMessage(self.uuid(label), attributes))

    def drag(self, name: str, poses: NDArray[np.float64]) -> Iterator[None]:
        """Drag a gizmo along some poses, a step of it each time it is asked; let go at the end. Shape (T, 7)."""
        self.send(_messages.TransformControlsDragStartMessage(name))
        for pose in poses.tolist():
            self.send(_messages.TransformControlsUpdateMessage(name, tuple(pose[3:]), tuple(pose[:3])))
            yield
        self.send(_messages.TransformControlsDragEndMessage(name))

    def shows(self, words: str, timeout_s: float) -> bool:
        """Wait until an element is sent that has these words, a regular expression. False when none was in time."""
        return not self.misses({words}, timeout_s)

    def misses(self, words: set[str], timeout_s: float) -> set[str]:
        """Wait until each of these regular expressions was found in an element; return those that were not in time."""
        end_s, missing = time.monotonic() + timeout_s, set(words)
        while missing and (left_s := end_s - time.monotonic()) > 0.0:
            try:
                messages = self.receive(left_s)
            except TimeoutError:
                break
            sent = [str(message.get("updates", message.get("props"))) for message in messages]
            missing = {each for each in missing if not any(re.search(each, text) for text in sent)}
        return missing

    def shows_pose(self, name: str, position_m: NDArray[np.float64], timeout_s: float) -> bool:
        """Wait until a node is sent to be at a place. False when it was not in time."""
        end_s = time.monotonic() + timeout_s
        while (left_s := end_s - time.monotonic()) > 0.0:
            try:
                messages = self.receive(left_s)
            except TimeoutError:
                return False
            places = [
                m["position"] for m in messages if m["type"] == "SetPositionMessage" and m["name"] == name
            ]
            if any(np.allclose(place, position_m) for place in places):
                return True
        return False

    def receive(self, timeout_s: float = _PATIENCE_S) -> list[dict[str, Any]]:
        """The next messages of the server.

        Raises:
            TimeoutError: When none came in time.
        """
        data = self._connection.recv(timeout_s)
        assert isinstance(data, bytes)
        self.n_bytes += len(data)
        size = int.from_bytes(data[8:16], "little")
        content = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(data[16 : 16 + size]))
        for message in content["messages"]:
            if "label" in message.get("props", {}):
                self.uuids[message["props"]["label"]] = message["uuid"]
        return content["messages"]

    def send(self, message: _messages.Message) -> None:
        """Send any message."""
        self.send_raw(message.as_serializable_dict())

    def send_raw(self, content: dict[str, Any]) -> None:
        """Send what need not be a message of viser."""
        self.send_bytes(msgspec.msgpack.encode(content))

    def send_bytes(self, data: bytes | str) -> None:
        """Send what need not be a message at all."""
        self._connection.send(data)
