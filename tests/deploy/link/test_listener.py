"""The door of the link's ports: many connections, silent ones, and a lack of descriptors end nothing."""

from __future__ import annotations

import asyncio
import contextlib
import resource
import socket
import subprocess
import sys
from collections.abc import Iterator

import pytest

from farhand.common.address import bind, free_port
from farhand.common.errors import LinkError
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.impairment.link_control import RelayControl
from farhand.deploy.link.listener import Listener, ListenerLimits, Visitor

HOST = "127.0.0.1"
FOREVER_S = 3600.0
PATIENT = ListenerLimits(most=1000, first_word_s=FOREVER_S, silence_s=FOREVER_S)

LINK = """
import asyncio, resource, sys
from farhand.deploy.link.link_process import run_link
resource.setrlimit(resource.RLIMIT_NOFILE, (int(sys.argv[1]), int(sys.argv[1])))
free = ("127.0.0.1", 0)
def ready(data, control):
    print(data[1], control[1], flush=True)
asyncio.run(run_link(free, ("127.0.0.1", int(sys.argv[2])), free, profile="lan", ready=ready))
"""


@contextlib.contextmanager
def idle_connections(port: int, n: int) -> Iterator[list[socket.socket]]:
    """Connections whose owner never says a word."""
    with contextlib.ExitStack() as held:
        yield [held.enter_context(socket.create_connection((HOST, port), 10)) for _ in range(n)]


async def echo(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    try:
        with contextlib.suppress(ConnectionError):  # a reset is how the link drops somebody
            while data := await reader.read(65536):
                writer.write(data)
    finally:
        writer.transport.abort()


async def serve_echo(visitor: Visitor) -> None:
    loop = asyncio.get_running_loop()
    while data := await loop.sock_recv(visitor.sock, 1000):
        visitor.heard()
        await loop.sock_sendall(visitor.sock, data)


@contextlib.asynccontextmanager
async def open_door(limits: ListenerLimits, serve=serve_echo):
    listener = bind((HOST, 0))
    door = Listener("test", serve, limits)
    door.start(listener)
    try:
        yield listener.getsockname()[1]
    finally:
        await door.close()
    assert listener.fileno() == -1


async def answers(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bool:
    writer.write(b"hello")
    return await reader.readexactly(5) == b"hello"


async def is_dropped(reader: asyncio.StreamReader) -> bool:
    try:
        return await reader.read() == b""
    except ConnectionResetError:
        return True


def test_who_never_says_a_word_is_dropped_and_who_does_stays(run):
    async def scenario() -> None:
        async with open_door(ListenerLimits(1000, first_word_s=0.1, silence_s=FOREVER_S)) as port:
            talker = await asyncio.open_connection(HOST, port)
            assert await answers(*talker)
            mute = await asyncio.open_connection(HOST, port)
            assert await is_dropped(mute[0])
            assert await answers(*talker)
            talker[1].close()
            mute[1].close()

    run(scenario)


def test_who_falls_silent_is_dropped(run):
    async def scenario() -> None:
        async with open_door(ListenerLimits(1000, first_word_s=FOREVER_S, silence_s=0.3)) as port:
            reader, writer = await asyncio.open_connection(HOST, port)
            assert await answers(reader, writer)
            assert await is_dropped(reader)
            writer.close()

    # The door looks as often as its first word asks for.
    run(scenario)


def test_for_one_too_many_the_one_that_is_silent_longest_gives_way(run):
    async def scenario() -> None:
        async with open_door(ListenerLimits(3, FOREVER_S, FOREVER_S)) as port:
            ends = [await asyncio.open_connection(HOST, port) for _ in range(3)]
            for k in (1, 2, 0):  # the second one is silent longest
                assert await answers(*ends[k])
            newest = await asyncio.open_connection(HOST, port)
            assert await answers(*newest)
            assert await is_dropped(ends[1][0])
            assert await answers(*ends[0]) and await answers(*ends[2])
            for _, writer in (*ends, newest):
                writer.close()

    run(scenario)


def test_a_visitor_that_is_not_read_is_not_silent(run):
    async def scenario() -> None:
        met: asyncio.Queue[Visitor] = asyncio.Queue()
        limits = ListenerLimits(1000, first_word_s=0.1, silence_s=0.1)

        async def hold_up(visitor: Visitor) -> None:
            visitor.not_listening()
            met.put_nowait(visitor)
            await asyncio.Event().wait()

        async with open_door(limits, hold_up) as port:
            _, writer = await asyncio.open_connection(HOST, port)
            visitor = await met.get()
            assert visitor.silent_s() == 0.0 and not visitor.is_over(limits)
            visitor.heard()
            reached = asyncio.get_running_loop().time() + 0.1
            await asyncio.sleep(reached - asyncio.get_running_loop().time())
            assert visitor.silent_s() >= 0.1
            writer.close()

    run(scenario)


def test_a_full_queue_of_the_relay_is_not_the_silence_of_its_source(run, linked):
    full = LinkSettings(uplink=DirectionSettings(queue_bytes=1000), downlink=DirectionSettings())

    async def scenario() -> None:
        async with linked(full) as bench:
            (_, writer), _ = await bench.dial()
            bench.relay.outage("stall", FOREVER_S)
            writer.write(bytes(10_000_000))
            await bench.until(lambda status: status["uplink"]["queued_bytes"] == 1000)
            (visitor,) = bench.relay._streams._listener._inside.values()
            while visitor.silent_s() > 0.0:
                await asyncio.sleep(0)

    run(scenario)


@pytest.mark.parametrize(("descriptors", "idle"), [(48, 150), (4096, 550)])
def test_idle_connections_neither_end_the_link_nor_keep_anybody_out(descriptors, idle):
    """Also on the control port, and where the process may have few descriptors only."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 4096), hard))

    async def scenario() -> None:
        remote = await asyncio.start_server(echo, HOST, 0)
        target = remote.sockets[0].getsockname()[1]
        words = [sys.executable, "-c", LINK, str(descriptors), str(target)]
        link = await asyncio.create_subprocess_exec(*words, stdout=subprocess.PIPE)
        assert link.stdout is not None
        try:
            data, control = map(int, (await link.stdout.readline()).split())
            with idle_connections(data, idle), idle_connections(control, idle):
                reader, writer = await asyncio.open_connection(HOST, data)
                assert await answers(reader, writer)
                status = await asyncio.to_thread(RelayControl(HOST, control, timeout_s=30.0).status)
                assert status["connections"] <= 64
                assert await answers(reader, writer)  # who speaks is not the one that gives way
                writer.close()
        finally:
            link.kill()
            await link.wait()
            remote.close()

    try:
        asyncio.run(asyncio.wait_for(scenario(), 60))
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_a_broken_listening_socket_ends_the_door_with_its_reason(run):
    async def scenario() -> None:
        with socket.socket() as not_listening:
            not_listening.bind((HOST, free_port()))
            not_listening.setblocking(False)
            door = Listener("test", serve_echo, PATIENT)
            door.start(not_listening)
            with pytest.raises(LinkError, match="can take no more connections"):
                await door.wait()
            await door.close()

    run(scenario)
