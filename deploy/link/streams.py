"""TCP side of the relay: each connection is dialled on to the remote site, and carried through delay lines."""

from __future__ import annotations

import logging
import math
import socket

from farhand.common.address import Address
from farhand.common.impairment.impairment import LinkSettings, Outage
from farhand.deploy.link.listener import Listener, ListenerLimits, Visitor, is_exhaustion
from farhand.deploy.link.relay_connection import Connection, Dialler, close
from farhand.deploy.link.relay_pipe import Meter

log = logging.getLogger(__name__)

_LIMITS = ListenerLimits(most=64, first_word_s=10.0, silence_s=180.0)
"""Limits that the sites keep: the transport sends at once, and a keep-alive every 30 s."""


class Streams:
    """Carrier of the TCP connections. Each connection has a rate and a queue of its own in each direction.

    Args:
        target: Address of the remote site, which may start later.
        settings: Settings of both directions; `change` replaces them.
        seed: Seed of a connection's jitter, together with the settings' seeds and the connection's number.
        meters: Meters of the uplink and the downlink.
    """

    def __init__(self, target: Address, settings: LinkSettings, seed: int, meters: tuple[Meter, Meter]):
        self._settings, self._seed, self._meters = settings, seed, meters
        self._connections: set[Connection] = set()
        self._listener = Listener("link", self._serve, _LIMITS)
        self._dialler = Dialler(target)
        self._outage: Outage = "none"
        self._outage_end_s = -math.inf
        self.accepted = 0
        """Number of accepted connections."""
        self.refused = 0
        """Number of refused connections."""

    @property
    def connections(self) -> int:
        """Number of present connections."""
        return len(self._connections)

    @property
    def target_error(self) -> str:
        """Reason why the newest connection to the remote site failed; empty if it succeeded."""
        return self._dialler.problem

    def queued_bytes(self, direction: int) -> int:
        """Return the bytes held back in one direction (0: uplink, 1: downlink) [B]."""
        return sum(connection.pipes[direction].queued_bytes for connection in self._connections)

    def start(self, listener: socket.socket) -> None:
        """Begin to accept connections."""
        self._listener.start(listener)

    async def wait(self) -> None:
        """Wait until `stop` is called; raise the error that ended the carrier otherwise."""
        await self._listener.wait()

    async def stop(self) -> None:
        """Cut all connections and release the port."""
        await self._listener.close()

    def change(self, settings: LinkSettings) -> None:
        """Replace the settings for what is sent from now on."""
        self._settings = settings
        for connection in self._connections:
            connection.change(settings)

    def interrupt(self, outage: Outage, until_s: float) -> None:
        """Begin an outage.

        Args:
            outage: Kind of the outage.
            until_s: End of the outage on the event loop's clock [s].
        """
        self._outage, self._outage_end_s = outage, until_s
        if outage == "reset":
            self._listener.empty()  # a connection that does not end in order ends with a reset
        for connection in self._connections:
            self._interrupt(connection)

    def resume(self) -> None:
        """End the present outage."""
        outage, self._outage = self._outage, "none"
        if outage == "blackhole":
            self._listener.empty()
        elif outage == "stall":
            for connection in self._connections:
                connection.stall(until_s=-math.inf)

    def forget(self) -> None:
        """Carry nothing more on the present connections, without closing them."""
        for connection in self._connections:
            connection.swallow()

    async def _serve(self, visitor: Visitor) -> None:
        if self._outage == "reset":
            self.refused += 1
            close(visitor.sock, reset=True)
            return
        self.accepted += 1
        number, sockets, in_order = self.accepted, [visitor.sock], False
        connection: Connection | None = None
        try:
            far = await self._dial()
            sockets.append(far)
            connection = Connection(visitor, far, self._settings, f"{self._seed}/{number}", self._meters)
            self._connections.add(connection)
            self._interrupt(connection)
            if beyond := self._settings.beyond_streams():
                log.warning("a TCP connection is carried without %s: TCP repairs them", ", ".join(beyond))
            in_order = await connection.run()
        except OSError as error:
            self.refused += connection is None
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
                await self._listener.wait_for_room(error)

    def _interrupt(self, connection: Connection) -> None:
        if self._outage == "stall":
            connection.stall(self._outage_end_s)
        elif self._outage == "blackhole":
            connection.swallow()
