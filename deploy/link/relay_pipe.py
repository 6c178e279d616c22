"""One direction of one relayed connection: read, hold back according to the delay line, write."""

from __future__ import annotations

import asyncio
import socket
from collections import deque

from farhand.common.impairment.delay_line import DelayLine
from farhand.common.impairment.impairment import DirectionSettings
from farhand.deploy.link.listener import Visitor

CHUNK_BYTES = 65536
CHUNK_S = 0.01
"""Longest sending time of a chunk [s]: a slow line then delivers steadily, not in lumps."""
MIN_CHUNK_BYTES = 64

Chunk = bytes | None
END: Chunk = b""
"""Mark behind the last byte: the source has closed its side."""
RESET: Chunk = None
"""Mark of a reset by the source; it reaches the other end behind the bytes sent before."""


class Meter:
    """Statistics of one direction, over all connections."""

    def __init__(self) -> None:
        self.delivered_bytes = 0
        self.swallowed_bytes = 0
        self.lateness_s: deque[float] = deque(maxlen=4096)
        """Actual minus due time of the newest chunks: the delay that this process adds to the link's [s]."""
        self.most_late_s: float | None = None
        """Largest lateness since the start [s]."""

    def forwarded(self, lateness_s: float) -> None:
        """Note a chunk with its lateness [s]."""
        self.lateness_s.append(lateness_s)
        self.most_late_s = max(lateness_s, self.most_late_s or 0.0)

    def report(self) -> dict[str, float | None]:
        """Return the bytes, and quantiles and maximum of the lateness [ms], which are None before the first chunk."""
        ordered = sorted(self.lateness_s)
        p50_ms, p99_ms = (
            round(1000 * ordered[int(quantile * (len(ordered) - 1))], 3) if ordered else None
            for quantile in (0.50, 0.99)
        )
        return {
            "delivered_bytes": self.delivered_bytes,
            "swallowed_bytes": self.swallowed_bytes,
            "lateness_p50_ms": p50_ms,
            "lateness_p99_ms": p99_ms,
            "lateness_max_ms": None if self.most_late_s is None else round(1000 * self.most_late_s, 3),
        }


class Pipe:
    """Carrier of bytes from one socket to another through a delay line.

    Both sockets are non-blocking; their owner closes them. `read` and `deliver` run as two tasks.

    Args:
        source: Socket to read from.
        sink: Socket to write to.
        line: Delay line, which sets the due time of each chunk.
        meter: Meter of this direction.
        visitor: Accepted connection that the bytes come from, whose silence is watched; None for others.
    """

    def __init__(
        self,
        source: socket.socket,
        sink: socket.socket,
        line: DelayLine,
        meter: Meter,
        visitor: Visitor | None = None,
    ):
        self._visitor = visitor
        self.opposite = self
        """Pipe of the same connection in the other direction."""
        self._source, self._sink, self._line, self._meter = source, sink, line, meter
        self._loop = asyncio.get_running_loop()
        self._chunks: deque[Chunk] = deque()  # in step with the line's queue
        self._wake = asyncio.Event()
        self._room = asyncio.Event()
        self._swallowing = False
        self._ended = False
        self._sink_lost = False
        self._sink_ready_s = self._loop.time()

    @property
    def queued_bytes(self) -> int:
        """Bytes held back."""
        return self._line.queued_bytes

    def change(self, settings: DirectionSettings) -> None:
        """Replace the line's parameters."""
        self._line.change(settings)
        self._room.set()  # the queue may have grown

    def stall(self, until_s: float) -> None:
        """Deliver nothing until that time of the event loop [s]."""
        self._line.stall(self._loop.time(), until_s)
        self._wake.set()

    def swallow(self) -> None:
        """Drop all held bytes and all that arrive later, without an error for the source."""
        self._swallowing = True
        self._meter.swallowed_bytes += self._line.queued_bytes
        self._line.clear()
        self._chunks.clear()
        self._room.set()

    async def read(self) -> None:
        """Read bytes while the queue has room; with a full queue the source has to wait."""
        chunk: Chunk = b"any"
        while chunk:
            if not self._line.free_bytes:
                await self._wait_for_room()
            try:
                chunk = await self._loop.sock_recv(self._source, self._chunk_limit())
            except OSError:
                chunk = RESET
            if chunk and self._visitor is not None:
                self._visitor.heard()
            self._put(chunk)
            await asyncio.sleep(0)  # a source that never pauses must not keep the others waiting

    async def deliver(self) -> None:
        """Write each chunk when it is due, until both directions have ended.

        Raises:
            ConnectionResetError: The source broke off, and it is time for the sink to learn it.
        """
        while not (self._ended and self.opposite._ended):
            due_s = self._line.next_due_s
            now_s = self._loop.time()
            if due_s is None or due_s > now_s:
                await self._wait(due_s)
                continue
            # Time spent waiting for the sink is not this process's lateness.
            self._meter.forwarded(now_s - max(due_s, self._sink_ready_s))
            self._line.pop()
            self._room.set()
            await self._write(self._chunks.popleft())

    async def _wait_for_room(self) -> None:
        if self._visitor is not None:
            self._visitor.not_listening()
        while not self._line.free_bytes:
            self._room.clear()
            await self._room.wait()
        if self._visitor is not None:
            self._visitor.heard()

    def _chunk_limit(self) -> int:
        rate_bps = self._line.settings.rate_bps
        paced = max(MIN_CHUNK_BYTES, int(rate_bps / 8 * CHUNK_S)) if rate_bps else CHUNK_BYTES
        return min(paced, CHUNK_BYTES, self._line.free_bytes)

    def _put(self, chunk: Chunk) -> None:
        if self._swallowing:
            self._meter.swallowed_bytes += len(chunk or b"")
            return
        if not self._chunks:
            self._wake.set()
        self._chunks.append(chunk)
        self._line.push(self._loop.time(), len(chunk or b""))

    async def _wait(self, due_s: float | None) -> None:
        self._wake.clear()
        timer = self._loop.call_at(due_s, self._wake.set) if due_s is not None else None
        try:
            await self._wake.wait()
        finally:
            if timer:
                timer.cancel()

    async def _write(self, chunk: Chunk) -> None:
        if chunk is None:
            raise ConnectionResetError
        if self._sink_lost:
            return
        try:
            if not chunk:  # END
                self._sink.shutdown(socket.SHUT_WR)
                self._ended = True
                self.opposite._wake.set()
            else:
                await self._loop.sock_sendall(self._sink, chunk)
                self._meter.delivered_bytes += len(chunk)
        except OSError:
            # The reset travels back over the link like all bytes, behind those that the sink had sent.
            self._sink_lost = True
            self.opposite._put(RESET)
        self._sink_ready_s = self._loop.time()
