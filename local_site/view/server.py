"""Web server of the page: viser, without its log and its public relay, with access rules of its own."""

from __future__ import annotations

import asyncio
import contextlib
import io
import logging
import socket
import threading
import time
import warnings
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import viser
from viser import _messages
from websockets.asyncio import server as websockets_server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from farhand.common.address import bind
from farhand.common.log import loop_logger
from farhand.local_site.view.incoming import LARGEST_BYTES, Incoming
from farhand.local_site.view.page_access import PageAccess, Visit
from farhand.local_site.view.panels.words.scripts import script_words
from farhand.local_site.view.sessions import Sessions
from farhand.local_site.view.uploads import PART_BYTES

_log = loop_logger(__name__)

_FILES = Path(__file__).parent
_SCRIPTS = ("page.js", "hand_keys.js", "tour.js")
_MOST_TABS = 32
_MOST_UNOPENED = 64
_MESSAGES_PER_S, _BYTES_PER_S, _BURST_S = 250.0, 4e6, 1.0
_MOST_WAITING = 4
"""Largest number of a tab's messages that are kept unread: each may be a part of a file."""
_STARTING = threading.Lock()
_GUARDS = {
    # No other page may frame ours to capture clicks, or keep a reference to its window.
    "X-Frame-Options": "DENY",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
}
_Judge = Callable[[ServerConnection, Request], Awaitable[Response | None] | Response | None]


class PageServer(viser.ViserServer):
    """Viser server on one port; the access decides on visitors, and only messages that a tab may send are accepted.

    Args:
        access: Address to bind, and rules of access.
        port: Port; 0 takes a free one.
        sessions: Open tabs, with the one that may act.
        refused: Called, on the server's thread, with a tab that tried to act but may not.

    Raises:
        LinkError: When the address or the port is not available.
    """

    def __init__(self, access: PageAccess, port: int, sessions: Sessions, refused: Callable[[int], None]):
        self._access = access
        self.incoming = Incoming(self, sessions, refused)
        # A port scan or a browser that gives up is not our error, and needs no traceback.
        logging.getLogger("websockets").setLevel(logging.CRITICAL)
        # A tab may go at any moment, also while it is told where to look from.
        warnings.filterwarnings("ignore", "Queued a .* on a closed connection")
        bound = bind((access.host, port), other_port="choose another one with --port")
        self.bound_port: int = bound.getsockname()[1]
        """Port of the server."""
        # viser prints a greeting to the standard output, which belongs to the command line.
        with contextlib.redirect_stdout(io.StringIO()), self._serving(bound):
            super().__init__(host=access.host, port=self.bound_port, label="Farhand", verbose=False)
        self.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        self.gui.add_html(f"<style>{(_FILES / 'page.css').read_text('utf-8')}</style>")
        # viser has no public way to give the page a script of its own; it keeps this message for late tabs.
        files = ((_FILES / name).read_text("utf-8") for name in _SCRIPTS)
        script = "\n".join((script_words(), *files))
        self._websock_server.queue_message(_messages.RunJavascriptMessage(source=script))

    @property
    def address(self) -> str:
        """Address to open in a browser."""
        return self._access.address(self.bound_port)

    def save_in(self, tab: int, name: str, content: bytes) -> None:
        """Have a tab's browser save a file, if the tab is still open.

        Args:
            tab: Number of the tab.
            name: Name of the file.
            content: Content of the file.
        """
        client = self.get_clients().get(tab)
        if client is not None:
            client.send_file_download(name, content, save_immediately=True)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse to share the page: that would open the operator's console to the internet."""
        return None

    @contextlib.contextmanager
    def _serving(self, bound: socket.socket) -> Iterator[None]:
        """Start viser's web server with the access rules, for which it has no parameter.

        Raises:
            RuntimeError: When viser did not apply them, so that no later version serves the page without them.
        """
        with _STARTING:
            usual, taken = websockets_server.serve, threading.Event()

            def serve(handler: Any, _host: object, _port: object, **settings: Any) -> Any:
                taken.set()
                files = settings.pop("process_request")
                return usual(
                    handler, sock=bound, process_request=self._judged(files), process_response=_guard,
                    create_connection=self._connection_kind(), **{**settings, "max_size": PART_BYTES + LARGEST_BYTES, "max_queue": _MOST_WAITING},
                )  # fmt: skip

            websockets_server.serve = serve  # type: ignore[assignment, misc]
            try:
                yield
            finally:
                websockets_server.serve = usual  # type: ignore[misc]
            if not taken.is_set():
                raise RuntimeError("this viser serves the page in another way than the one that is guarded")

    def _judged(self, files: _Judge) -> _Judge:
        """Return the handler that judges each request, for a page or a websocket, before viser sees it."""

        def judge(connection: ServerConnection, request: Request) -> Any:
            talks = any("websocket" in value.lower() for value in request.headers.get_all("Upgrade"))
            answer = self._access.judge(_visit(connection, request), self.bound_port, talks)
            if answer is not None:
                if answer.why:
                    _log.warning(
                        "a visit from %s was turned away: %s", connection.remote_address[0], answer.why
                    )
                kind = {"Content-Type": "text/html; charset=utf-8", "Cache-Control": "no-store"}
                body = answer.page.encode()
                headers = {**kind, **answer.headers, "Content-Length": str(len(body)), "Connection": "close"}
                return Response(answer.status, answer.status.phrase, Headers(headers), body)
            if talks and len(self._websock_server._live_connections) >= _MOST_TABS:
                return connection.respond(503, f"{_MOST_TABS} tabs are open already: close some\n")
            return None if talks else files(connection, request)

        return judge

    def _connection_kind(self) -> type[ServerConnection]:
        """Return the class of this server's connections."""
        incoming, tabs = self.incoming, self._tab_of

        class TabConnection(ServerConnection):
            """Connection of one tab: each message is judged, and their rate is limited to that of a hand."""

            _read_until_s = 0.0

            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                super().connection_made(transport)
                waiting = [each for each in self.server.handlers if each.request is None]
                if len(waiting) > _MOST_UNOPENED:
                    waiting[0].transport.abort()  # the oldest: it has not requested anything yet

            async def recv(self, decode: bool | None = None) -> Any:
                while True:
                    data = await super().recv(decode=False)
                    now_s = time.monotonic()
                    cost_s = max(1.0 / _MESSAGES_PER_S, len(data) / _BYTES_PER_S)
                    self._read_until_s = max(self._read_until_s, now_s) + cost_s
                    # At least once round the loop: what came before is done, and other tabs have their turn.
                    await asyncio.sleep(max(self._read_until_s - now_s - _BURST_S, 0.0))
                    tab = tabs(self)
                    if tab is not None and incoming.admits(tab, data):
                        return data

        return TabConnection

    def _tab_of(self, connection: ServerConnection) -> int | None:
        """Return the number of a connection's tab."""
        live = self._websock_server._live_connections
        return next((tab for tab, each in live.items() if each is connection), None)


def _visit(connection: ServerConnection, request: Request) -> Visit:
    headers = [(name.lower(), value) for name, value in request.headers.raw_items()]
    return Visit(request.path, headers, connection.remote_address[0], connection.local_address[0])


def _guard(_connection: ServerConnection, _request: Request, response: Response) -> None:
    for name, value in _GUARDS.items():
        response.headers[name] = value
