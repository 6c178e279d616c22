"""A relay with a remote site behind it, over real sockets, for the tests of the link process."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import Any

import pytest

from farhand.common.impairment.impairment import LinkSettings
from farhand.deploy.link.relay import Relay

HOST = "127.0.0.1"
Stream = tuple[asyncio.StreamReader, asyncio.StreamWriter]


class Remote:
    """The remote site: takes connections and hands them to the test."""

    def __init__(self) -> None:
        self._taken: asyncio.Queue[Stream] = asyncio.Queue()
        self._writers: list[asyncio.StreamWriter] = []

    async def start(self, port: int = 0) -> tuple[str, int]:
        self._server = await asyncio.start_server(self._take, HOST, port)
        self.port: int = self._server.sockets[0].getsockname()[1]
        return HOST, self.port

    async def _take(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.append(writer)
        self._taken.put_nowait((reader, writer))

    async def connection(self) -> Stream:
        return await self._taken.get()

    async def stop(self) -> None:
        self._server.close()
        for writer in self._writers:
            writer.transport.abort()
        await self._server.wait_closed()


class Bench:
    """Local end, relay and remote site."""

    def __init__(self, relay: Relay, remote: Remote):
        self.relay, self.remote = relay, remote
        self._writers: list[asyncio.StreamWriter] = []

    async def dial(self) -> tuple[Stream, Stream]:
        """Both ends of a new connection, the local one first."""
        return await self.knock(), await self.remote.connection()

    async def knock(self) -> Stream:
        """The local end of a connection that may not get through."""
        stream = await asyncio.open_connection(*self.relay.address)
        self._writers.append(stream[1])
        return stream

    async def until(self, condition: Callable[[dict[str, Any]], bool]) -> None:
        """Let the event loop turn until the relay's status is so."""
        while not condition(self.relay.status()):
            await asyncio.sleep(0)

    async def assert_open(self, ends: tuple[Stream, Stream]) -> None:
        local, remote = ends
        local[1].write(b"up")
        assert await remote[0].readexactly(2) == b"up"
        remote[1].write(b"down")
        assert await local[0].readexactly(4) == b"down"

    async def assert_reset(self, reader: asyncio.StreamReader) -> None:
        with pytest.raises(ConnectionResetError):
            await reader.read()

    def close(self) -> None:
        for writer in self._writers:
            writer.transport.abort()


Linked = Callable[..., AbstractAsyncContextManager[Bench]]


@pytest.fixture
def linked() -> Linked:
    """Makes benches: `async with linked(settings) as bench`."""

    @asynccontextmanager
    async def make(settings: LinkSettings | None = None) -> AsyncIterator[Bench]:
        remote = Remote()
        relay = Relay((HOST, 0), await remote.start(), settings or LinkSettings())
        await relay.start()
        bench = Bench(relay, remote)
        try:
            yield bench
        finally:
            bench.close()
            await relay.stop()
            await remote.stop()

    return make


@pytest.fixture
def run() -> Callable[[Callable[[], Coroutine[Any, Any, None]]], None]:
    """Runs a scenario to its end and sees that it leaves no task behind."""

    async def limited(scenario: Callable[[], Coroutine[Any, Any, None]]) -> None:
        async with asyncio.timeout(60):
            await scenario()
        assert asyncio.all_tasks() == {asyncio.current_task()}

    return lambda scenario: asyncio.run(limited(scenario))
