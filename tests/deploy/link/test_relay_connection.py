"""How connections through the relay begin and end, and the relay itself."""

from __future__ import annotations

import asyncio
import logging
import socket
from typing import Any

import pytest

from farhand.common.errors import LinkError
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.deploy.link.relay import Relay

HOST = "127.0.0.1"
FOREVER_S = 3600.0


def both_ways(**fields: Any) -> LinkSettings:
    return LinkSettings(uplink=DirectionSettings(**fields), downlink=DirectionSettings(**fields))


def test_a_half_closed_connection_still_carries_the_other_way(run, linked):
    async def scenario() -> None:
        async with linked(both_ways(delay_ms=10)) as bench:
            (local_reader, local_writer), (remote_reader, remote_writer) = await bench.dial()
            local_writer.write(b"question")
            local_writer.write_eof()
            assert await remote_reader.read() == b"question"
            remote_writer.write(b"answer")
            remote_writer.close()
            assert await local_reader.read() == b"answer"

    run(scenario)


@pytest.mark.parametrize("broken", [0, 1])
def test_a_side_that_breaks_off_resets_the_other_one_delay_later(run, linked, broken):
    async def scenario() -> None:
        now = asyncio.get_running_loop().time
        async with linked(both_ways(delay_ms=100)) as bench:
            ends = await bench.dial()
            await bench.assert_open(ends)
            lost: socket.socket = ends[broken][1].get_extra_info("socket")
            lost.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            broken_s = now()
            ends[broken][1].transport.abort()
            await bench.assert_reset(ends[1 - broken][0])
            assert now() - broken_s >= 0.1
            await bench.assert_open(await bench.dial())

    run(scenario)


def test_a_side_that_has_left_resets_the_other_once_it_is_written_to(run, linked):
    async def scenario() -> None:
        async with linked(both_ways(delay_ms=10)) as bench:
            (_, local_writer), (remote_reader, remote_writer) = await bench.dial()
            local_writer.transport.abort()
            assert await remote_reader.read() == b""
            while bench.relay.status()["connections"]:
                remote_writer.write(b"is anybody there?")
                await asyncio.sleep(0)

    run(scenario)


def test_the_target_may_come_later(run, linked, caplog):
    caplog.set_level(logging.INFO)

    async def scenario() -> None:
        async with linked() as bench:
            await bench.remote.stop()
            for _ in range(3):
                reader, _ = await bench.knock()
                await bench.assert_reset(reader)
            assert caplog.text.count("nobody answers yet") == 1
            await bench.remote.start(bench.remote.port)
            await bench.assert_open(await bench.dial())
            assert not [record for record in caplog.records if record.levelno >= logging.WARNING]
            await bench.remote.stop()
            reader, _ = await bench.knock()
            await bench.assert_reset(reader)
            assert "nobody answers at" in caplog.records[-1].getMessage()
            assert caplog.records[-1].levelno == logging.WARNING

    run(scenario)


def test_many_connections_come_and_go(run, linked):
    async def scenario() -> None:
        async with linked() as bench:
            for _ in range(100):
                local, remote = await bench.dial()
                await bench.assert_open((local, remote))
                local[1].close()
                assert await remote[0].read() == b""
                remote[1].close()
            await bench.until(lambda status: status["connections"] == 0)
            assert bench.relay.status()["accepted"] == 100

    run(scenario)


def test_stopping_cuts_the_connections_and_gives_the_port_back(run, linked):
    async def scenario() -> None:
        async with linked(both_ways(delay_ms=FOREVER_S)) as bench:
            (local_reader, local_writer), _ = await bench.dial()
            local_writer.write(b"never arrives")
            bench.relay.outage("stall", FOREVER_S)
            await bench.relay.stop()
            await bench.assert_reset(local_reader)
            again = Relay(bench.relay.address, (HOST, 9), LinkSettings())
            await again.start()
            await again.stop()
            await again.wait()

    run(scenario)


def test_a_port_in_use_is_one_clear_error(run, linked):
    async def scenario() -> None:
        async with linked() as bench:
            port = bench.relay.address[1]
            with pytest.raises(
                LinkError, match=f"port {port} on 127.0.0.1 is in use: .* choose another port"
            ):
                await Relay(bench.relay.address, (HOST, 9), LinkSettings()).start()

    run(scenario)


@pytest.mark.parametrize("listen", [("203.0.113.1", 7447), (HOST, 70_000), ("no host of ours", 7447)])
def test_an_address_of_another_machine_is_one_clear_error(run, listen):
    async def scenario() -> None:
        with pytest.raises(LinkError, match="cannot listen on"):
            await Relay(listen, (HOST, 9), LinkSettings()).start()

    run(scenario)
