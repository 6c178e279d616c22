"""The link process: a TCP relay between the sites that delays, paces, stalls and cuts.

The local site dials the relay, which dials the remote site for every connection. The sites cannot tell it
from a slow network, except that TCP's own handshake is not delayed, and that no single packet is lost. Rate
and queue hold for each connection and direction; the sites keep one connection.
"""

from __future__ import annotations

import asyncio
import logging
import math
import socket
from typing import Any

import msgspec

from farhand.common.address import Address, bind, show_address
from farhand.common.errors import InvalidConfiguration
from farhand.common.impairment.impairment import LinkSettings, Outage
from farhand.common.impairment.timeline import Timeline
from farhand.deploy.link.listener import Door, DoorLimits, Visitor, is_exhaustion
from farhand.deploy.link.relay_connection import SOCKET_BUFFER_BYTES, Connection, Dialler, close
from farhand.deploy.link.relay_pipe import Meter
from farhand.deploy.link.timeline_player import TimelinePlayer

log = logging.getLogger(__name__)

MAX_OUTAGE_S = 86_400.0
_LIMITS = DoorLimits(most=64, first_word_s=10.0, silence_s=180.0)
"""The sites speak at once, and every 30 s at least: the transport's own sign of life."""


class Relay:
    """Carries every connection made to `listen` to `target`, through the link's impairments.

    All methods run in the event loop in which `start` ran.

    Args:
        listen: Where the local site dials; port 0 takes a free one.
        target: Where the remote site listens; it may come later.
        settings: Both directions, fixed or over time; `change` replaces them.
        seed: With the settings' seeds and a connection's number it fixes the jitter of the connection.
        profile: Name of the settings, for the status.

    Raises:
        InvalidConfiguration: The settings ask for what a TCP relay cannot do.
    """

    def __init__(
        self,
        listen: Address,
        target: Address,
        settings: LinkSettings | Timeline,
        seed: int = 0,
        profile: str = "custom",
    ):
        self._listen, self._target, self._seed = listen, target, seed
        self._timeline = settings if isinstance(settings, Timeline) else Timeline(settings)
        self._timeline.require_stream()
        self._settings, self._profile = self._timeline.at(0.0), profile
        self._player = TimelinePlayer(self._apply)
        self._meters = (Meter(), Meter())
        self._connections: set[Connection] = set()
        self._door = Door("link", self._serve, _LIMITS)
        self._listener: socket.socket | None = None
        self._accepting: asyncio.Task[None] | None = None
        self._accepted = 0
        self._refused = 0
        self._dialler = Dialler(target)
        self._outage: Outage = "none"
        self._outage_end: asyncio.TimerHandle | None = None

    @property
    def address(self) -> Address:
        """Where the relay listens, with the port that it got."""
        return self._listen

    @property
    def settings(self) -> LinkSettings:
        """The settings in force."""
        return self._settings

    async def start(self) -> None:
        """Bind and begin to accept.

        Raises:
            LinkError: The port is in use, or the address is not of this machine.
        """
        self._listener = bind(self._listen, SOCKET_BUFFER_BYTES)
        host, port, *_ = self._listener.getsockname()
        self._listen = (host, port)
        self.change(self._timeline, self._profile)
        self._accepting = asyncio.create_task(self._door.run(self._listener), name="relay accept")

    async def wait(self) -> None:
        """Return when the relay was stopped; raise what ended it if it ended by itself."""
        if self._accepting:
            await asyncio.wait([self._accepting])
            if not self._accepting.cancelled():
                self._accepting.result()

    async def stop(self) -> None:
        """Cut all connections and give the port back."""
        self.clear()
        self._player.stop()
        if self._accepting and self._listener:
            self._accepting.cancel()
            await asyncio.wait([self._accepting])  # from here on nobody is let in
            self._listener.close()
        await self._door.close()

    def change(self, settings: LinkSettings | Timeline, profile: str = "custom") -> None:
        """Replace the settings for what is sent from now on; a timeline begins now.

        Raises:
            InvalidConfiguration: They ask for what a TCP relay cannot do; nothing has changed.
        """
        timeline = settings if isinstance(settings, Timeline) else Timeline(settings)
        timeline.require_stream()
        self._timeline, self._profile = timeline, profile
        for warning in timeline.base.short_queues():
            log.warning(warning)
        self._player.play(timeline)
        log.info("the link is now: %s", profile)

    def outage(self, kind: Outage, duration_s: float = 0.0) -> None:
        """Interrupt both directions for a while, instead of an outage under way.

        Args:
            kind: `stall` holds everything and delivers it afterwards; `blackhole` swallows everything and
                cuts the connections at its end; `reset` cuts them now and refuses new ones meanwhile;
                `none` ends the outage under way.
            duration_s: How long [s].

        Raises:
            InvalidConfiguration: The duration is not above 0 and finite; nothing has changed.
        """
        if kind != "none" and not 0 < duration_s <= MAX_OUTAGE_S:
            expected = f"expected seconds above 0 and up to {MAX_OUTAGE_S:g}, not {duration_s}"
            raise InvalidConfiguration("outage", "duration_s", expected)
        self.clear()
        if kind == "none":
            return
        loop = asyncio.get_running_loop()
        self._outage, self._outage_end = kind, loop.call_later(duration_s, self.clear)
        if kind == "reset":
            self._door.empty()  # a connection that does not end in order ends with a reset
        for connection in self._connections:
            self._interrupt(connection)
        log.info("outage: %s for %g s", kind, duration_s)

    def clear(self) -> None:
        """End the outage under way, if there is one."""
        if not self._outage_end:
            return
        self._outage_end.cancel()
        kind, self._outage, self._outage_end = self._outage, "none", None
        if kind == "blackhole":
            self._door.empty()
        elif kind == "stall":
            for connection in self._connections:
                connection.stall(until_s=-math.inf)
        log.info("outage: %s is over", kind)

    def status(self) -> dict[str, Any]:
        """The settings, the outage, the traffic and the relay's own lateness, fit for JSON."""
        remaining_s = 0.0
        if self._outage_end:
            remaining_s = max(0.0, self._outage_end.when() - asyncio.get_running_loop().time())
        return {
            "listen": show_address(self._listen),
            "target": show_address(self._target),
            "profile": self._profile,
            "settings": msgspec.to_builtins(self._settings),
            "outage": {"kind": self._outage, "remaining_s": remaining_s},
            "connections": len(self._connections),
            "accepted": self._accepted,
            "refused": self._refused,
            "target_error": self._dialler.problem,
            "uplink": self._traffic(0),
            "downlink": self._traffic(1),
        }

    def _traffic(self, direction: int) -> dict[str, Any]:
        queued_bytes = sum(connection.pipes[direction].queued_bytes for connection in self._connections)
        return {"queued_bytes": queued_bytes, **self._meters[direction].report()}

    async def _serve(self, visitor: Visitor) -> None:
        if self._outage == "reset":
            self._refused += 1
            close(visitor.sock, reset=True)
            return
        self._accepted += 1
        number, sockets, in_order = self._accepted, [visitor.sock], False
        connection: Connection | None = None
        try:
            far = await self._dial()
            sockets.append(far)
            connection = Connection(visitor, far, self._settings, f"{self._seed}/{number}", self._meters)
            self._connections.add(connection)
            self._interrupt(connection)
            in_order = await connection.run()
        except OSError as error:
            self._refused += connection is None
            log.debug("connection %d: %s", number, error)
        finally:
            if connection:
                self._connections.discard(connection)
            for sock in sockets:
                close(sock, reset=not in_order)

    async def _dial(self) -> socket.socket:
        while True:
            try:
                return await self._dialler.dial()
            except OSError as error:
                if not is_exhaustion(error):
                    raise
                await self._door.wait_for_room(error)

    def _apply(self, settings: LinkSettings) -> None:
        self._settings = settings
        for connection in self._connections:
            connection.change(settings)

    def _interrupt(self, connection: Connection) -> None:
        if self._outage == "stall" and self._outage_end:
            connection.stall(self._outage_end.when())
        elif self._outage == "blackhole":
            connection.swallow()
