"""One relayed connection: two sockets and a pipe in each direction between them."""

from __future__ import annotations

import asyncio
import logging
import socket
import struct

from farhand.common.address import Address, show_address
from farhand.common.impairment.delay_line import DelayLine
from farhand.common.impairment.impairment import LinkSettings
from farhand.deploy.link.listener import Visitor, is_exhaustion
from farhand.deploy.link.relay_pipe import Meter, Pipe

log = logging.getLogger(__name__)

DIAL_TIMEOUT_S = 5.0
SOCKET_BUFFER_BYTES = 65536
"""Size of the kernel's buffers, whose content `queue_bytes` does not bound [B]."""


class Connection:
    """Carrier of the bytes in both directions until both ends have closed, or one has reset.

    Args:
        near: Accepted connection of the local site.
        far: Socket to the remote site.
        settings: Settings of both directions.
        stream: Name of the connection; its jitter depends on it and on the settings' seeds.
        meters: Meters of the uplink and the downlink.
    """

    def __init__(
        self,
        near: Visitor,
        far: socket.socket,
        settings: LinkSettings,
        stream: str,
        meters: tuple[Meter, Meter],
    ):
        for sock in (near.sock, far):
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SOCKET_BUFFER_BYTES)
        uplink = Pipe(near.sock, far, DelayLine(settings.uplink, f"{stream}/uplink"), meters[0], near)
        downlink = Pipe(far, near.sock, DelayLine(settings.downlink, f"{stream}/downlink"), meters[1])
        uplink.opposite, downlink.opposite = downlink, uplink
        self.pipes = (uplink, downlink)
        """Uplink, downlink."""

    async def run(self) -> bool:
        """Carry until the end.

        Returns:
            True if both ends have closed in order; False if one has reset, and the other must be reset too.
        """
        in_order = True
        try:
            async with asyncio.TaskGroup() as tasks:
                for pipe in self.pipes:
                    tasks.create_task(pipe.read())
                    tasks.create_task(pipe.deliver())
        except* ConnectionResetError:
            in_order = False
        return in_order

    def change(self, settings: LinkSettings) -> None:
        """Replace the settings for what is sent from now on."""
        for pipe, direction in zip(self.pipes, (settings.uplink, settings.downlink), strict=True):
            pipe.change(direction)

    def stall(self, until_s: float) -> None:
        """Deliver nothing until that time of the event loop [s]."""
        for pipe in self.pipes:
            pipe.stall(until_s)

    def swallow(self) -> None:
        """Drop all bytes in transit and all that arrive later."""
        for pipe in self.pipes:
            pipe.swallow()


class Dialler:
    """Dialler of the remote site, once for each connection of the local site.

    Args:
        target: Address of the remote site.
    """

    def __init__(self, target: Address):
        self._target = target
        self._answers, self._ever = True, False
        self.problem = ""
        """Reason why the newest connection failed; empty if it succeeded."""

    async def dial(self) -> socket.socket:
        """Return a non-blocking socket connected to the target.

        Raises:
            OSError: The target's name is unknown, or nobody answers within `DIAL_TIMEOUT_S`.
        """
        try:
            connected = await _connect(self._target)
        except OSError as error:
            if is_exhaustion(error):
                raise  # nobody was asked
            self.problem = error.strerror or "time-out"
            if self._answers:  # the local site tries again and again: say it once
                # Before the robot's site is up that is nothing to worry about.
                level, yet = (logging.WARNING, "") if self._ever else (logging.INFO, " yet")
                where, why = show_address(self._target), self.problem
                log.log(level, "nobody answers%s at %s (%s): it is tried again", yet, where, why)
            self._answers = False
            raise
        self._answers, self._ever, self.problem = True, True, ""
        return connected


async def _connect(target: Address) -> socket.socket:
    loop = asyncio.get_running_loop()
    async with asyncio.timeout(DIAL_TIMEOUT_S):
        found = await loop.getaddrinfo(*target, type=socket.SOCK_STREAM)
        family, kind, _, _, resolved = found[0]
        sock = socket.socket(family, kind)
        try:
            sock.setblocking(False)
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SOCKET_BUFFER_BYTES)
            await loop.sock_connect(sock, resolved)
        except BaseException:
            sock.close()
            raise
    return sock


def close(sock: socket.socket, *, reset: bool) -> None:
    """Close a socket, in order or by a reset, which makes the peer lose unread bytes."""
    if reset:
        # A linger of no time makes the kernel send RST.
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    sock.close()
