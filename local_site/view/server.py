"""The web server of the page: viser, quiet, without its public relay, and deaf to other web sites."""

from __future__ import annotations

import contextlib
import io
import logging
import socket
from pathlib import Path
from urllib.parse import urlsplit

import viser
from viser import _messages
from viser.infra import ClientId, WebsockClientConnection

from farhand.common.errors import PortTaken

_FILES = Path(__file__).parent


class PortInUse(PortTaken):
    """The page's port cannot be had."""


class PageServer(viser.ViserServer):
    """A viser server on one port, or none.

    Args:
        host: Address to bind; there is no access control, so keep it on this machine.
        port: Port; 0 takes a free one.

    Raises:
        PortInUse: When something else has the port.
    """

    def __init__(self, host: str, port: int):
        _require_free(host, port)
        # A port scan or a browser that gives up is no error of ours, and needs no traceback.
        logging.getLogger("websockets").setLevel(logging.CRITICAL)
        # viser greets on the standard output, which belongs to the command line.
        with contextlib.redirect_stdout(io.StringIO()):
            super().__init__(host=host, port=port, label="Farhand", verbose=False)
        if port and self.get_port() != port:
            self.stop()
            raise PortInUse(
                f"port {port} of {host} was taken by another program meanwhile: choose another one"
            )
        self.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        self.gui.add_html(f"<style>{(_FILES / 'page.css').read_text()}</style>")
        # viser has no public way to give the page a script of its own; it keeps this message for late tabs.
        script = _messages.RunJavascriptMessage(source=(_FILES / "page.js").read_text())
        self._websock_server.queue_message(script)
        self._websock_server.on_client_connect(self._refuse_other_sites)
        self._websock_server.unregister_handler(_messages.GuiUpdateMessage)
        self._websock_server.register_handler(_messages.GuiUpdateMessage, self._take_value)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refused: it would open the operator's console to the internet; any tab could ask for it."""
        return None

    async def _refuse_other_sites(self, client: WebsockClientConnection) -> None:
        """A page of another web site, open in the same browser, must not command the robot."""
        connection = self._websock_server._live_connections[client.client_id]
        headers = connection.request.headers if connection.request is not None else {}
        origin = headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != headers.get("Host"):
            await connection.close(1008, "this console takes commands from its own page alone")

    async def _take_value(self, client_id: ClientId, message: _messages.GuiUpdateMessage) -> None:
        """Viser lets a tab set any attribute of an element, so it could take STOP away from the others."""
        if message.updates.keys() == {"value"}:
            await self.gui._handle_gui_updates(client_id, message)


def _require_free(host: str, port: int) -> None:
    """Viser would quietly take the next port."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            raise PortInUse(
                f"the page cannot be served at {host} port {port} ({error.strerror}): choose another one with --port"
            ) from error
