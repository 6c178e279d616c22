"""The door of a listening socket: it lets in, keeps a bounded number, and sees those out who say nothing."""

from __future__ import annotations

import asyncio
import errno
import logging
import socket
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from farhand.common.errors import LinkError

log = logging.getLogger(__name__)

_EXHAUSTED = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
_RETRY_S = 0.1


@dataclass(frozen=True)
class ListenerLimits:
    """Bounds of what a door lets in.

    Args:
        most: Connections at a time; for one more, the first by `Visitor.gives_way` is dropped.
        first_word_s: Silence after which a connection is dropped that never said anything [s].
        silence_s: Silence after which one is dropped that did [s].
    """

    most: int
    first_word_s: float
    silence_s: float


class Visitor:
    """One accepted connection.

    Args:
        sock: Its non-blocking socket; the door closes it.
    """

    def __init__(self, sock: socket.socket):
        self.sock = sock
        self._loop = asyncio.get_running_loop()
        self._spoke = False
        self._heard_s: float | None = self._loop.time()

    def heard(self) -> None:
        """Take note that it said something."""
        self._spoke, self._heard_s = True, self._loop.time()

    def not_listening(self) -> None:
        """Take note that it is not being read: its silence means nothing until `heard` is called."""
        self._heard_s = None

    def silent_s(self) -> float:
        """Return how long it has been silent [s]; zero while it is not being read."""
        return 0.0 if self._heard_s is None else self._loop.time() - self._heard_s

    def gives_way(self) -> tuple[bool, float]:
        """Return its rank among those that may have to go: who never spoke comes first, then the silent."""
        return not self._spoke, self.silent_s()

    def is_over(self, limits: ListenerLimits) -> bool:
        """Decide whether it was silent for too long."""
        return self.silent_s() > (limits.silence_s if self._spoke else limits.first_word_s)


def is_exhaustion(error: OSError) -> bool:
    """Decide whether an error says that the process or the system has no descriptor or memory left."""
    return error.errno in _EXHAUSTED


Serve = Callable[[Visitor], Coroutine[Any, Any, None]]


class Listener:
    """Accepts connections and serves each in a task of its own.

    Neither many connections nor a lack of descriptors ends it: who has never said anything gives way, then who is silent longest.

    Args:
        name: For its log.
        serve: Serves one connection until its end; is cancelled when the connection is dropped.
        limits: How many, and how silent.
    """

    def __init__(self, name: str, serve: Serve, limits: ListenerLimits):
        self._name, self._serve, self._limits = name, serve, limits
        self._inside: dict[asyncio.Task[None], Visitor] = {}
        self._leaving: set[asyncio.Task[None]] = set()
        self._exhausted = False
        self._socket: socket.socket | None = None
        self._accepting: asyncio.Task[None] | None = None

    def start(self, listening: socket.socket) -> None:
        """Let connections in from now on; `close` closes the socket too."""
        self._socket = listening
        self._accepting = asyncio.create_task(self._run(listening), name=f"{self._name} accept")

    async def wait(self) -> None:
        """Return when `close` was called.

        Raises:
            LinkError: When the listening socket itself fails.
        """
        if self._accepting:
            await asyncio.wait([self._accepting])
            if not self._accepting.cancelled():
                self._accepting.result()

    async def _run(self, listening: socket.socket) -> None:
        drops = asyncio.create_task(self._drop_silent(), name=f"{self._name} drops the silent")
        try:
            while True:
                await self._let_in(listening)
        finally:
            drops.cancel()
            await asyncio.wait([drops])

    def empty(self) -> None:
        """Drop every connection."""
        for task in list(self._inside):
            self._drop(task)

    async def close(self) -> None:
        """Let nobody in any more, give the port back, drop every connection, and wait until all are gone."""
        if self._accepting and self._socket:
            self._accepting.cancel()
            await asyncio.wait([self._accepting])
            self._socket.close()
        self.empty()
        if self._leaving:
            await asyncio.wait(self._leaving)

    async def _let_in(self, listener: socket.socket) -> None:
        try:
            sock, _ = await asyncio.get_running_loop().sock_accept(listener)
        except ConnectionAbortedError:  # it has gone before it was taken
            return
        except OSError as error:
            if not is_exhaustion(error):
                raise LinkError(f"the {self._name} can take no more connections: {error.strerror}") from error
            await self.wait_for_room(error)
            return
        self._exhausted = False
        while len(self._inside) >= self._limits.most:
            self._drop_most_silent(f"it already has {self._limits.most} connections")
        visitor = Visitor(sock)
        task = asyncio.create_task(self._serve(visitor), name=self._name)
        self._inside[task] = visitor
        task.add_done_callback(self._forget)

    async def wait_for_room(self, error: OSError) -> None:
        """Drop the connection that is silent longest, and wait a moment: the process has no descriptor left."""
        if not self._exhausted:
            log.warning(
                "the %s waits to accept: %s; the connection that is silent longest is dropped",
                self._name, error.strerror,
            )  # fmt: skip
        self._exhausted = True
        if self._inside:
            self._drop_most_silent("of a lack of descriptors or memory")
        await asyncio.sleep(_RETRY_S)

    def _drop_most_silent(self, why: str) -> None:
        task = max(self._inside, key=lambda task: self._inside[task].gives_way())
        log.debug("the %s drops the connection that is silent longest, because %s", self._name, why)
        self._drop(task)

    async def _drop_silent(self) -> None:
        while True:
            await asyncio.sleep(min(1.0, self._limits.first_word_s / 2))
            for task, visitor in list(self._inside.items()):
                if visitor.is_over(self._limits):
                    log.info("the %s drops a connection: silent for %.0f s", self._name, visitor.silent_s())
                    self._drop(task)

    def _drop(self, task: asyncio.Task[None]) -> None:
        visitor = self._inside.pop(task)
        self._leaving.add(task)
        task.add_done_callback(
            lambda _: visitor.sock.close()
        )  # also of one that is cancelled before it began
        task.cancel()

    def _forget(self, task: asyncio.Task[None]) -> None:
        self._leaving.discard(task)
        if (visitor := self._inside.pop(task, None)) is not None:
            visitor.sock.close()
        if not task.cancelled() and (error := task.exception()):
            log.error("a connection of the %s failed", self._name, exc_info=error)
