"""A browser's visit of the page, without the browser: the page itself, its cookie, and its websocket."""

from __future__ import annotations

import http.client
from http import HTTPStatus
from importlib.metadata import version
from socket import create_connection
from typing import Any
from urllib.parse import urlsplit

import msgspec
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from farhand.evaluation.harness.real_process import HOST

_PATIENCE_S = 60.0
CAMERA: dict[str, Any] = {
    "type": "ViewerCameraMessage", "wxyz": (1.0, 0.0, 0.0, 0.0), "position": (0.0, 0.0, 5.0), "fov": 0.35, "near": 0.1,
    "far": 50.0, "image_height": 560, "image_width": 900, "look_at": (0.0, 0.0, 0.0), "up_direction": (0.0, 1.0, 0.0),
}  # fmt: skip
"""What a tab sends first: it counts as open from then on."""
SUBPROTOCOL = Subprotocol(f"viser-v{version('viser')}")


def visit(address: str, port: int) -> str:
    """Open the page as a browser does that finds its name at a port of this machine.

    Args:
        address: What is in the address bar.
        port: Where that name leads.

    Returns:
        The words of the refusal; an empty string when the page was loaded and its websocket brought something.
    """
    parts = urlsplit(address)
    target, cookie = f"/?{parts.query}" if parts.query else "/", ""
    for _ in range(2):
        status, headers, words = _get(port, parts.netloc, target, cookie)
        if status == HTTPStatus.OK:
            return _talk(parts.netloc, port, f"{parts.scheme}://{parts.netloc}", cookie)
        if status != HTTPStatus.SEE_OTHER:
            return words
        target, cookie = "/", headers["Set-Cookie"].partition(";")[0]
    return "the page leads nowhere"


def _get(port: int, name: str, target: str, cookie: str) -> tuple[int, http.client.HTTPMessage, str]:
    connection = http.client.HTTPConnection(HOST, port, timeout=_PATIENCE_S)
    try:
        connection.request("GET", target, headers={"Host": name, "Connection": "close", "Cookie": cookie})
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read().decode(errors="replace")
    finally:
        connection.close()


def _talk(name: str, port: int, origin: str, cookie: str) -> str:
    try:
        with connect(
            f"ws://{name}/", sock=create_connection((HOST, port)), origin=Origin(origin), max_size=None,
            subprotocols=[SUBPROTOCOL], additional_headers={"Cookie": cookie}, close_timeout=1.0,
        ) as page:  # fmt: skip
            page.send(msgspec.msgpack.encode(CAMERA))
            page.recv(_PATIENCE_S)
    except InvalidStatus as error:
        return (error.response.body or b"").decode(errors="replace") or str(error)
    return ""
