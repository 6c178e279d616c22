"""`farhand link`: the relay and the server of its control socket, until a signal ends them.

The client of the control socket is in `farhand.common.impairment.link_control`.
"""

from __future__ import annotations

import asyncio
import logging
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import msgspec

from farhand.common.address import Address, bind
from farhand.common.errors import InvalidInput
from farhand.common.impairment.link_control import (
    CONTROL_PORT,
    MAX_LINE_BYTES,
    Answer,
    ForeignLine,
    OutageRequest,
    ProfileRequest,
    RebindRequest,
    Request,
    SetRequest,
    StatusRequest,
    decode_request,
    refuse,
)
from farhand.common.impairment.link_profile import LinkProfile, find_profile, load_profiles, update_settings
from farhand.deploy.link.listener import Listener, ListenerLimits, Visitor
from farhand.deploy.link.relay import Relay

log = logging.getLogger(__name__)

_LIMITS = ListenerLimits(most=16, first_word_s=10.0, silence_s=60.0)


class ControlServer:
    """Server of the control socket, for a relay in the same event loop.

    Args:
        relay: The relay to control.
        profiles: Profiles that a request may name.
        listen: Host and port; port 0 takes a free one. There is no access control: keep it on loopback or
            on a network of its own.
    """

    def __init__(self, relay: Relay, profiles: Mapping[str, LinkProfile], listen: Address):
        self._relay, self._profiles, self._listen = relay, profiles, listen
        self._listener = Listener("link's control", self._serve, _LIMITS)

    @property
    def address(self) -> Address:
        """Address of the control socket, with its actual port."""
        return self._listen

    async def start(self) -> None:
        """Bind the port and begin to answer.

        Raises:
            LinkError: The port is in use, or the address is not of this machine.
        """
        listening = bind(self._listen)
        host, port, *_ = listening.getsockname()
        self._listen = (host, port)
        self._listener.start(listening)

    async def stop(self) -> None:
        """Release the port and close all connections."""
        await self._listener.close()

    def answer(self, line: bytes | None) -> Answer:
        """Carry out the request in a line, wholly or not at all; None stands for a line that is too long.

        Raises:
            ForeignLine: When the line is not of this protocol.
        """
        try:
            self._do(decode_request(line))
        except ForeignLine:
            raise
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
            case RebindRequest():
                relay.rebind()
            case StatusRequest():
                pass
            case _:
                relay.clear()

    async def _serve(self, visitor: Visitor) -> None:
        reader, writer = await asyncio.open_connection(sock=visitor.sock, limit=MAX_LINE_BYTES)
        try:
            while (line := await _next_line(reader)) != b"":
                visitor.heard()
                try:
                    answer = self.answer(line)
                except ForeignLine as error:
                    await _see_out(reader, writer, error)
                    return
                writer.write(msgspec.json.encode(answer) + b"\n")
                await writer.drain()
        except ConnectionError as error:
            log.debug("a control client has gone: %s", error)
        finally:
            writer.close()


async def _next_line(reader: asyncio.StreamReader) -> bytes | None:
    """Return the next line, empty at the end; None for one that is too long."""
    try:
        return await reader.readline()
    except ValueError:  # how asyncio says that the line is too long
        return None


async def _see_out(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, error: ForeignLine) -> None:
    """Refuse a client who speaks another protocol.

    A web page's form may carry a line of ours further down, so nothing that follows is understood; it is
    read, since closing on unread bytes would lose the answer.
    """
    writer.write(msgspec.json.encode(refuse(error)) + b"\n")
    await writer.drain()
    writer.write_eof()
    while await reader.read(MAX_LINE_BYTES):
        pass


PROFILES_FILE = Path(__file__).parents[1] / "link_profiles.toml"


async def run_link(
    listen: Address,
    target: Address,
    control: Address = ("127.0.0.1", CONTROL_PORT),
    *,
    profile: str = "geo",
    seed: int = 0,
    profiles_file: Path = PROFILES_FILE,
    ready: Callable[[Address, Address], None] | None = None,
) -> None:
    """Run the simulated link until SIGINT, SIGTERM or cancellation.

    Args:
        listen: Address for the local site to dial; port 0 takes a free one.
        target: Address of the remote site.
        control: Address for `farhand.common.impairment.link_control.RelayControl` to connect to.
        profile: Name of a profile in `profiles_file`.
        seed: Seed of all random numbers.
        profiles_file: TOML file, see `farhand.common.impairment.link_profile`.
        ready: Called once when both ports are bound, with the addresses of data and control.

    Raises:
        InvalidConfiguration: The profiles are malformed, or there is none of that name.
        LinkError: A port is in use, or an address is not of this machine.
    """
    profiles = load_profiles(profiles_file)
    timeline = find_profile(profiles, profile).over_time(f"link profile {profile}")
    relay = Relay(listen, target, timeline, seed, profile)
    server = ControlServer(relay, profiles, control)
    ended = asyncio.Event()
    with _ended_by_signals(ended):
        try:
            await relay.start()
            await server.start()
            log.info("the link is ready: %s port %d to %s port %d, %s", *relay.address, *target, profile)
            log.info("the link's control: %s port %d", *server.address)
            if ready:
                ready(relay.address, server.address)
            await _first_of(ended, relay)
        finally:
            await server.stop()
            await relay.stop()


async def _first_of(ended: asyncio.Event, relay: Relay) -> None:
    """Wait for a signal, or for the relay to fail; raise its error."""
    signalled = asyncio.create_task(ended.wait())
    failed = asyncio.create_task(relay.wait())
    try:
        await asyncio.wait([signalled, failed], return_when=asyncio.FIRST_COMPLETED)
        if failed.done():
            failed.result()
    finally:
        signalled.cancel()
        failed.cancel()


@contextmanager
def _ended_by_signals(ended: asyncio.Event) -> Iterator[None]:
    """Let SIGINT and SIGTERM set the event; only the main thread may do so."""
    signals = (signal.SIGINT, signal.SIGTERM)
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    loop = asyncio.get_running_loop()
    for number in signals:
        loop.add_signal_handler(number, ended.set)
    try:
        yield
    finally:
        for number in signals:
            loop.remove_signal_handler(number)
