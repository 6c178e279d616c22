"""Listening socket with a bounded number of connections; silent ones are dropped."""

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
    """Limits of a listening socket.

    Args:
        most: Largest number of connections; for a further one, the first by `Visitor.gives_way` is dropped.
        first_word_s: Silence after which a connection that never sent anything is dropped [s].
        silence_s: Silence after which any other connection is dropped [s].
    """

    most: int
    first_word_s: float
    silence_s: float


class Visitor:
    """Accepted connection.

    Args:
        sock: Non-blocking socket of the connection; the listener closes it.
    """

    def __init__(self, sock: socket.socket):
        self.sock = sock
        self._loop = asyncio.get_running_loop()
        self._spoke = False
        self._heard_s: float | None = self._loop.time()

    def heard(self) -> None:
        """Note that the connection has sent something."""
        self._spoke, self._heard_s = True, self._loop.time()

    def not_listening(self) -> None:
        """Note that the connection is not being read: until `heard` is called its silence is ignored."""
        self._heard_s = None

    def silent_s(self) -> float:
        """Return the silence of the connection [s]; zero while it is not being read."""
        return 0.0 if self._heard_s is None else self._loop.time() - self._heard_s

    def gives_way(self) -> tuple[bool, float]:
        """Return the rank for being dropped: connections that never sent anything first, then by their silence."""
        return not self._spoke, self.silent_s()

    def is_over(self, limits: ListenerLimits) -> bool:
        """Decide whether the silence exceeds the limit."""
        return self.silent_s() > (limits.silence_s if self._spoke else limits.first_word_s)


def is_exhaustion(error: OSError) -> bool:
    """Decide whether an error means a lack of descriptors or memory."""
    return error.errno in _EXHAUSTED


Serve = Callable[[Visitor], Coroutine[Any, Any, None]]


class Listener:
    """Listener that serves each connection in a task of its own.

    Neither many connections nor a lack of descriptors ends it: one that never sent anything is dropped, else the most
    silent one.

    Args:
        name: Name for the log.
        serve: Serves one connection until its end; is cancelled when the connection is dropped.
        limits: Limits of number and silence.
    """

    def __init__(self, name: str, serve: Serve, limits: ListenerLimits):
        self._name, self._serve, self._limits = name, serve, limits
        self._inside: dict[asyncio.Task[None], Visitor] = {}
        self._leaving: set[asyncio.Task[None]] = set()
        self._exhausted = False
        self._socket: socket.socket | None = None
        self._accepting: asyncio.Task[None] | None = None

    def start(self, listening: socket.socket) -> None:
        """Begin to accept connections; `close` closes the socket too."""
        self._socket = listening
        self._accepting = asyncio.create_task(self._run(listening), name=f"{self._name} accept")

    async def wait(self) -> None:
        """Wait until `close` is called.

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
        """Stop accepting, release the port, drop every connection, and wait until all have ended."""
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
