"""A browser's visit of the page, without the browser: the page itself, its cookie, and its websocket.

A reverse proxy in front of the page, as many stand there: a process of its own that rewrites `Host`.
"""

from __future__ import annotations

import contextlib
import http.client
import multiprocessing
import os
import re
import socketserver
import threading
from collections.abc import Iterator
from http import HTTPStatus
from importlib.metadata import version
from multiprocessing.connection import Connection
from socket import SHUT_WR, create_connection, socket
from typing import Any
from urllib.parse import urlsplit

import msgspec
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from farhand.common.parent_process import end_with_parent
from farhand.evaluation.harness.farhand_process import HOST

_PATIENCE_S = 60.0
CAMERA: dict[str, Any] = {
    "type": "ViewerCameraMessage", "wxyz": (1.0, 0.0, 0.0, 0.0), "position": (0.0, 0.0, 5.0), "fov": 0.35, "near": 0.1,
    "far": 50.0, "image_height": 560, "image_width": 900, "look_at": (0.0, 0.0, 0.0), "up_direction": (0.0, 1.0, 0.0),
}  # fmt: skip
"""First message of a tab, which makes it open."""
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


_HOST = "127.0.0.1"
_CHUNK_BYTES, _MOST_HEAD_BYTES = 1 << 16, 1 << 18


@contextlib.contextmanager
def reverse_proxy(port: int) -> Iterator[int]:
    """Run a proxy for a page at a port of this machine, which may come later.

    Yields:
        The port of the proxy.
    """
    spawning = multiprocessing.get_context("spawn")
    ours, theirs = spawning.Pipe()
    process = spawning.Process(target=_serve, args=(theirs, port, os.getpid()), daemon=True)
    process.start()
    theirs.close()  # so that its end is seen here
    try:
        yield ours.recv()
    finally:
        process.kill()
        process.join()


def _serve(pipe: Connection, port: int, parent_pid: int) -> None:
    end_with_parent(parent_pid)

    class Handler(socketserver.BaseRequestHandler):
        """One connection of a browser."""

        def handle(self) -> None:
            with contextlib.suppress(OSError), create_connection((_HOST, port)) as page:
                head = _head(self.request)
                page.sendall(_rewritten(head, port, self.client_address[0]))
                back = threading.Thread(target=_pass_on, args=(page, self.request))
                back.start()
                _pass_on(self.request, page)
                back.join()

    with socketserver.ThreadingTCPServer((_HOST, 0), Handler) as server:
        pipe.send(server.server_address[1])
        server.serve_forever()


def _head(browser: socket) -> bytes:
    head = b""
    while b"\r\n\r\n" not in head and len(head) < _MOST_HEAD_BYTES and (part := browser.recv(_CHUNK_BYTES)):
        head += part
    return head


def _rewritten(head: bytes, port: int, visitor: str) -> bytes:
    """Return the request as the page gets it: under the page's own address, and with the visitor's in a header."""
    named = b"Host: %s:%d\r\nX-Forwarded-For: %s" % (_HOST.encode(), port, visitor.encode())
    return re.sub(rb"(?im)^host:[^\r]*", named, head, count=1)


def _pass_on(source: Any, sink: Any) -> None:
    with contextlib.suppress(OSError):
        while data := source.recv(_CHUNK_BYTES):
            sink.sendall(data)
    with contextlib.suppress(OSError):
        sink.shutdown(SHUT_WR)
