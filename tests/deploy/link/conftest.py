"""Two sites with UDP sockets and the relay between them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import Any

import pytest

from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.deploy.link.relay import Relay

HOST = "127.0.0.1"
BURST = 50
"""So few datagrams that no kernel buffer overflows meanwhile."""


class End(asyncio.DatagramProtocol):
    """One site's socket: keeps what it hears, with the time and the sender."""

    def __init__(self) -> None:
        self.heard: list[bytes] = []
        self.times_s: list[float] = []
        self.senders: list[tuple[str, int]] = []
        self.transport: asyncio.DatagramTransport

    async def open(self, remote: tuple[str, int] | None = None) -> tuple[str, int]:
        loop = asyncio.get_running_loop()
        local = None if remote else (HOST, 0)
        self.transport, _ = await loop.create_datagram_endpoint(
            lambda: self, local_addr=local, remote_addr=remote
        )
        return self.transport.get_extra_info("sockname")

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        self.heard.append(data)
        self.times_s.append(asyncio.get_running_loop().time())
        self.senders.append(addr)

    def error_received(self, exc: Exception) -> None:
        pass

    async def until_heard(self, n: int) -> None:
        while len(self.heard) < n:
            await asyncio.sleep(0)


class Bench:
    """Local end, relay, remote end."""

    def __init__(self, relay: Relay, local: End, remote: End):
        self.relay, self.local, self.remote = relay, local, remote

    def numbers(self) -> list[int]:
        """What the remote site heard, as numbers."""
        return [int.from_bytes(data, "big") for data in self.remote.heard]

    def tally(self, direction: str = "uplink") -> dict[str, int]:
        return self.relay.status()[direction]["datagrams"]

    async def until(self, condition: Callable[[dict[str, Any]], bool]) -> None:
        while not condition(self.relay.status()):
            await asyncio.sleep(0)

    async def send(self, n: int, make: Callable[[int], bytes] = lambda k: k.to_bytes(4, "big")) -> None:
        """Send so many up, and let all that is under way arrive."""
        for k in range(n):
            self.local.transport.sendto(make(k))
            if k % BURST == BURST - 1 or k == n - 1:
                await self.until(lambda status, k=k: status["uplink"]["datagrams"]["taken"] == k + 1)
                await self.until(lambda status: status["uplink"]["queued_bytes"] == 0)
                await self.remote.until_heard(self.tally()["delivered"])


@pytest.fixture
def udp() -> Callable[..., AbstractAsyncContextManager[Bench]]:
    @asynccontextmanager
    async def make(
        uplink: dict[str, Any] | None = None, downlink: dict[str, Any] | None = None
    ) -> AsyncIterator[Bench]:
        remote, local = End(), End()
        settings = LinkSettings(
            uplink=DirectionSettings(**uplink or {}), downlink=DirectionSettings(**downlink or {})
        )
        relay = Relay((HOST, 0), await remote.open(), settings)
        await relay.start()
        await local.open(relay.address)
        try:
            yield Bench(relay, local, remote)
        finally:
            local.transport.abort()
            remote.transport.abort()
            await relay.stop()
            await asyncio.sleep(0)

    return make
