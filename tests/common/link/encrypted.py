"""Helpers for links over QUIC: the relay in a thread, an operator's end, and what arrives."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from pathlib import Path

from farhand.common.impairment.impairment import LinkSettings
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.common.wire import keys
from farhand.deploy.link.relay import Relay

HOST = "127.0.0.1"
PATIENCE_S = 60.0


class RelayThread:
    """The relay in a thread of its own."""

    def __init__(self, target_port: int, settings: LinkSettings):
        self._loop = asyncio.new_event_loop()
        self._ready, self._end = threading.Event(), asyncio.Event()
        self._thread = threading.Thread(
            target=self._loop.run_until_complete, args=(self._run(target_port, settings),)
        )
        self._thread.start()
        assert self._ready.wait(PATIENCE_S)

    async def _run(self, target_port: int, settings: LinkSettings) -> None:
        self._relay = Relay((HOST, 0), (HOST, target_port), settings)
        await self._relay.start()
        self.port = self._relay.address[1]
        self._ready.set()
        await self._end.wait()
        await self._relay.stop()

    def do(self, what: Callable[[Relay], object]) -> object:
        """Do something with the relay in its own thread."""

        async def done() -> object:
            return what(self._relay)

        return asyncio.run_coroutine_threadsafe(done(), self._loop).result(PATIENCE_S)

    def close(self) -> None:
        self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join()
        self._loop.close()


def operator(folder: Path, port: int) -> ZenohLink:
    return ZenohLink(EndpointSettings(connect=f"quic/{HOST}:{port}", certificates=str(folder)))


def ask_until_answered(link: ZenohLink, data: bytes = b"abc") -> bytes:
    while (answer := link.ask_and_wait(keys.LEASE, data, 5.0)) is None:
        pass  # an unconnected question is answered with nothing at once
    return answer


class Heard:
    """What arrived on a channel."""

    def __init__(self, link: ZenohLink, channel: keys.Channel):
        self.items: list[int] = []
        self._changed = threading.Condition()
        link.subscribe(channel, self._take)

    def _take(self, data: bytes) -> None:
        with self._changed:
            self.items.append(int.from_bytes(data[:4], "big"))
            self._changed.notify_all()

    def until(self, holds: Callable[[list[int]], bool], timeout_s: float = PATIENCE_S) -> bool:
        with self._changed:
            return self._changed.wait_for(lambda: holds(self.items), timeout_s)
