"""UDP side of the relay: the datagrams of each sender go on to the remote site from a port of their own."""

from __future__ import annotations

import asyncio
import logging
import socket

from farhand.common.address import Address, show_address
from farhand.common.impairment.impairment import LinkSettings, Outage
from farhand.deploy.link.datagram_direction import DatagramWay
from farhand.deploy.link.relay_pipe import Meter

log = logging.getLogger(__name__)

BUFFER_BYTES = 2**21
"""Size of the kernel's buffers, for bursts that arrive while this process is busy [B]."""
_MOST_FLOWS, _MOST_WAITING = 64, 64
_SILENCE_S = 180.0


class Flow(asyncio.DatagramProtocol):
    """Flow of the datagrams of one sender.

    Args:
        near: Address of the sender.
        carrier: Carrier of all flows, which takes the remote site's answers.
        now_s: Present time of the event loop [s].
    """

    def __init__(self, near: Address, carrier: Datagrams, now_s: float):
        self.near, self.heard_s = near, now_s
        self._carrier = carrier
        self._far: asyncio.DatagramTransport | None = None
        self._waiting: list[bytes] = []
        self._opening = asyncio.create_task(self._connect(), name="relay flow")

    def rebind(self) -> None:
        """Continue from a new port."""
        self.close()
        self._opening = asyncio.create_task(self._connect(), name="relay flow")

    def close(self) -> None:
        """Release the port."""
        self._opening.cancel()
        if self._far is not None:
            self._far.abort()
        self._far = None

    async def wait_closed(self) -> None:
        """Wait until the flow's task has ended."""
        await asyncio.wait([self._opening])

    def send(self, data: bytes) -> None:
        """Send a datagram on; it waits while the remote site's name is being looked up."""
        if self._far is not None:
            self._far.sendto(data)
            return
        if len(self._waiting) < _MOST_WAITING:
            self._waiting.append(data)
        if self._opening.done():  # the name was not found the last time
            self._opening = asyncio.create_task(self._connect(), name="relay flow")

    async def _connect(self) -> None:
        loop, target = asyncio.get_running_loop(), self._carrier.target
        try:
            self._far, _ = await loop.create_datagram_endpoint(lambda: self, remote_addr=target)
        except OSError as error:
            self._carrier.problem(error)
            return
        enlarge_buffers(self._far.get_extra_info("socket"))
        waiting, self._waiting = self._waiting, []
        for data in waiting:
            self._far.sendto(data)

    def datagram_received(self, data: bytes, addr: object) -> None:
        """Pass on a datagram of the remote site."""
        self._carrier.came_back(data, self)

    def error_received(self, exc: Exception) -> None:
        """Note that nobody listens at the remote site's port."""
        if isinstance(exc, OSError):
            self._carrier.problem(exc)


class Datagrams(asyncio.DatagramProtocol):
    """Carrier of the UDP datagrams, through one line in each direction.

    Args:
        target: Address of the remote site, which may start later.
        settings: Settings of both directions; `change` replaces them.
        seed: Seed of all random numbers, together with the settings' seeds.
        meters: Meters of the uplink and the downlink.
    """

    def __init__(self, target: Address, settings: LinkSettings, seed: int, meters: tuple[Meter, Meter]):
        self.target = target
        self._flows: dict[Address, Flow] = {}
        self._near: asyncio.DatagramTransport | None = None
        self._outage: Outage = "none"
        self._loop = asyncio.get_running_loop()
        self.ways = (
            DatagramWay(settings.uplink, f"{seed}/uplink", meters[0]),
            DatagramWay(settings.downlink, f"{seed}/downlink", meters[1]),
        )
        """Uplink, downlink."""
        self.target_error = ""
        """Reason why the newest datagram did not reach the remote site; empty once the site has answered."""
        self.accepted = 0
        """Number of senders since the start."""
        self.rebinds = 0
        """Number of changes of the ports towards the remote site."""

    @property
    def flows(self) -> int:
        """Number of present senders."""
        return len(self._flows)

    @property
    def senders(self) -> list[str]:
        """Addresses of the present senders."""
        return sorted(map(show_address, self._flows))

    async def start(self, sock: socket.socket) -> None:
        """Begin to carry the datagrams that arrive at a bound socket."""
        enlarge_buffers(sock)
        self._near, _ = await self._loop.create_datagram_endpoint(lambda: self, sock=sock)

    async def stop(self) -> None:
        """Drop the datagrams in transit and release all ports."""
        for way in self.ways:
            way.clear()
        flows = list(self._flows.values())
        self._forget_flows()
        for flow in flows:
            await flow.wait_closed()
        if self._near is not None:
            self._near.abort()

    def change(self, settings: LinkSettings) -> None:
        """Replace the settings for what is sent from now on."""
        for way, direction in zip(self.ways, (settings.uplink, settings.downlink), strict=True):
            way.change(direction)

    def interrupt(self, outage: Outage, until_s: float) -> None:
        """Begin an outage. A datagram cannot be refused, so a reset swallows datagrams like a blackhole."""
        self._outage = outage
        for way in self.ways:
            if outage == "stall":
                way.stall(until_s)
            else:
                way.swallow(True)

    def resume(self) -> None:
        """End the present outage. After a reset the remote site sees every sender at a new port."""
        outage, self._outage = self._outage, "none"
        for way in self.ways:
            if outage == "stall":
                way.stall(self._loop.time())
            else:
                way.swallow(False)
        if outage == "reset":
            self._forget_flows()

    def rebind(self) -> None:
        """Continue from other ports towards the remote site; its datagrams to the old ports are lost."""
        self.rebinds += 1
        for flow in self._flows.values():
            flow.rebind()

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Take a datagram of the local site."""
        near = (addr[0], addr[1])
        if (flow := self._flows.get(near)) is None:
            self._make_room()
            flow = self._flows[near] = Flow(near, self, self._loop.time())
            self.accepted += 1
        flow.heard_s = self._loop.time()
        self.ways[0].push(data, flow.send)

    def came_back(self, data: bytes, flow: Flow) -> None:
        """Take a datagram of the remote site."""
        self.target_error = ""
        flow.heard_s = self._loop.time()
        if (near := self._near) is not None:
            self.ways[1].push(data, lambda arrived: near.sendto(arrived, flow.near))

    def problem(self, error: OSError) -> None:
        """Note that the remote site was not reached."""
        if not self.target_error:  # the local site tries again and again: say it once
            log.info(
                "nobody answers at %s (%s): it is tried again", show_address(self.target), error.strerror
            )
        self.target_error = error.strerror or str(error)

    def _make_room(self) -> None:
        """Forget the senders that have been silent for long, and the most silent one where there are too many."""
        now_s = self._loop.time()
        silent = [flow for flow in self._flows.values() if now_s - flow.heard_s > _SILENCE_S]
        if len(self._flows) - len(silent) >= _MOST_FLOWS:
            silent = [min(self._flows.values(), key=lambda flow: flow.heard_s)]
        for flow in silent:
            flow.close()
            del self._flows[flow.near]

    def _forget_flows(self) -> None:
        for flow in self._flows.values():
            flow.close()
        self._flows.clear()


def enlarge_buffers(sock: socket.socket) -> None:
    """Let the kernel keep bursts; it gives as much as it allows."""
    for option in (socket.SO_RCVBUF, socket.SO_SNDBUF):
        sock.setsockopt(socket.SOL_SOCKET, option, BUFFER_BYTES)
