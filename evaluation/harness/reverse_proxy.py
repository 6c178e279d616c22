"""A reverse proxy in front of the page, as many stand there: a process of its own that rewrites `Host`."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import re
import socketserver
import threading
from collections.abc import Iterator
from multiprocessing.connection import Connection
from socket import SHUT_WR, create_connection, socket
from typing import Any

from farhand.common.parent_process import end_with_parent

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
