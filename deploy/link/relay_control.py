"""The control socket of the link process: the server's side of `farhand.common.impairment.link_control`."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping

import msgspec

from farhand.common.errors import InvalidInput, InvalidMessage
from farhand.common.impairment.link_control import (
    MAX_LINE_BYTES,
    Answer,
    OutageRequest,
    ProfileRequest,
    Request,
    SetRequest,
    StatusRequest,
    decode_request,
    refuse,
)
from farhand.common.impairment.link_profile import LinkProfile, find_profile
from farhand.common.impairment.timeline import update_settings
from farhand.deploy.link.listener import Address, bind
from farhand.deploy.link.relay import Relay

log = logging.getLogger(__name__)

_TOO_LONG = refuse(InvalidMessage("link request", "", f"expected a line of at most {MAX_LINE_BYTES} bytes"))


class ControlServer:
    """Answers the requests of `farhand.common.impairment.link_control` for a relay in the same event loop.

    Args:
        relay: What is controlled.
        profiles: The profiles that a request may name.
        listen: Host and port; port 0 takes a free one. There is no access control: keep it on loopback or
            on a network of its own.
    """

    def __init__(self, relay: Relay, profiles: Mapping[str, LinkProfile], listen: Address):
        self._relay, self._profiles, self._listen = relay, profiles, listen
        self._server: asyncio.Server | None = None
        self._clients: dict[asyncio.StreamWriter, asyncio.Task[None] | None] = {}

    @property
    def address(self) -> Address:
        """Where it listens, with the port that it got."""
        return self._listen

    async def start(self) -> None:
        """Bind and begin to answer.

        Raises:
            LinkError: The port is in use, or the address is not of this machine.
        """
        listener = bind(self._listen)
        host, port, *_ = listener.getsockname()
        self._listen = (host, port)
        self._server = await asyncio.start_server(self._serve, sock=listener, limit=MAX_LINE_BYTES)

    async def stop(self) -> None:
        """Give the port back and close what is open."""
        if self._server:
            self._server.close()
            await self._server.wait_closed()
        serving = [task for task in self._clients.values() if task]
        for client in self._clients:
            client.transport.abort()  # its reader sees the end and leaves
        if serving:
            await asyncio.wait(serving)

    def answer(self, line: bytes) -> Answer:
        """Do what a line asks for, wholly or not at all."""
        try:
            self._do(decode_request(line))
        except InvalidInput as error:
            return refuse(error)
        return Answer(status=self._relay.status())

    def _do(self, request: Request) -> None:
        relay = self._relay
        match request:
            case ProfileRequest(name=name):
                relay.change(find_profile(self._profiles, name).over_time(f"link profile {name}"), name)
            case SetRequest(uplink=uplink, downlink=downlink):
                relay.change(update_settings(relay.settings, uplink=uplink, downlink=downlink))
            case OutageRequest(kind=kind, duration_s=duration_s):
                relay.outage(kind, duration_s)
            case StatusRequest():
                pass
            case _:
                relay.clear()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._clients[writer] = asyncio.current_task()
        try:
            while answer := await self._answer_next(reader):
                writer.write(msgspec.json.encode(answer) + b"\n")
                await writer.drain()
        except ConnectionError as error:
            log.debug("a control client has gone: %s", error)
        finally:
            del self._clients[writer]
            writer.close()

    async def _answer_next(self, reader: asyncio.StreamReader) -> Answer | None:
        try:
            line = await reader.readline()
        except ValueError:  # how asyncio says that the line is too long
            return _TOO_LONG
        return self.answer(line) if line else None
