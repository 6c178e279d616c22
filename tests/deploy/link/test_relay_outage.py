"""What each kind of outage does to real connections."""

from __future__ import annotations

import asyncio
import math
import socket
import threading
from typing import Any

import pytest

from farhand.common.errors import InvalidConfiguration
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings

FOREVER_S = 3600.0


def both_ways(**fields: Any) -> LinkSettings:
    return LinkSettings(uplink=DirectionSettings(**fields), downlink=DirectionSettings(**fields))


def test_a_stall_holds_everything_and_delivers_it_afterwards(run, linked):
    async def scenario() -> None:
        async with linked() as bench:
            (_, local_writer), (remote_reader, _) = await bench.dial()
            bench.relay.outage("stall", FOREVER_S)
            local_writer.write(b"held")
            await bench.until(lambda status: status["uplink"]["queued_bytes"] == 4)
            assert bench.relay.status()["outage"]["kind"] == "stall"
            assert bench.relay.status()["uplink"]["delivered_bytes"] == 0
            bench.relay.clear()
            assert await remote_reader.readexactly(4) == b"held"
            assert bench.relay.status()["outage"] == {"kind": "none", "remaining_s": 0.0}

    run(scenario)


def test_a_stall_ends_by_itself_and_holds_for_connections_made_meanwhile(run, linked):
    async def scenario() -> None:
        now = asyncio.get_running_loop().time
        async with linked() as bench:
            before = await bench.dial()
            began_s = now()
            bench.relay.outage("stall", 0.3)
            during = await bench.dial()
            for (_, local_writer), (remote_reader, _) in (during, before):
                local_writer.write(b"x")
                await remote_reader.readexactly(1)
                assert now() - began_s >= 0.3

    run(scenario)


def test_a_blackhole_swallows_everything_and_then_cuts(run, linked):
    async def scenario() -> None:
        async with linked(both_ways(delay_ms=50)) as bench:
            (local_reader, local_writer), (remote_reader, _) = await bench.dial()
            local_writer.write(b"in flight")
            await bench.until(lambda status: status["uplink"]["queued_bytes"] == 9)
            bench.relay.outage("blackhole", FOREVER_S)
            local_writer.write(b"lost")
            await bench.until(lambda status: status["uplink"]["swallowed_bytes"] == 13)
            assert bench.relay.status()["connections"] == 1
            bench.relay.clear()
            await bench.assert_reset(local_reader)
            await bench.assert_reset(remote_reader)
            assert bench.relay.status()["uplink"]["delivered_bytes"] == 0
            await bench.assert_open(await bench.dial())

    run(scenario)


def test_a_blackhole_swallows_a_flood_without_stopping_the_relay(run, linked):
    def flood(address: tuple[str, int], begun: threading.Event) -> None:
        with socket.create_connection(address) as sock, pytest.raises(ConnectionError):
            while True:
                sock.sendall(bytes(2**20))
                begun.set()

    async def scenario() -> None:
        async with linked(both_ways(queue_bytes=1000)) as bench:
            bench.relay.outage("blackhole", FOREVER_S)
            begun = threading.Event()  # the flood comes from a thread: it never waits for our event loop
            flooding = asyncio.create_task(asyncio.to_thread(flood, bench.relay.address, begun))
            await asyncio.to_thread(begun.wait, 30)
            await bench.until(lambda status: status["uplink"]["swallowed_bytes"] > 2**22)
            assert bench.relay.status()["uplink"]["queued_bytes"] == 0
            bench.relay.clear()
            await flooding

    run(scenario)


def test_a_reset_cuts_both_sides_and_refuses_until_it_is_over(run, linked):
    async def scenario() -> None:
        async with linked() as bench:
            ends = await bench.dial()
            await bench.assert_open(ends)
            bench.relay.outage("reset", FOREVER_S)
            for reader, _ in ends:
                await bench.assert_reset(reader)
            reader, _ = await bench.knock()
            await bench.assert_reset(reader)
            assert bench.relay.status()["refused"] == 1
            bench.relay.clear()
            await bench.assert_open(await bench.dial())

    run(scenario)


def test_a_reset_ends_by_itself(run, linked):
    async def scenario() -> None:
        async with linked() as bench:
            bench.relay.outage("reset", 0.05)
            await bench.until(lambda status: status["outage"]["kind"] == "none")
            await bench.assert_open(await bench.dial())

    run(scenario)


def test_an_outage_replaces_the_one_under_way(run, linked):
    async def scenario() -> None:
        async with linked() as bench:
            ends = await bench.dial()
            bench.relay.outage("stall", FOREVER_S)
            bench.relay.outage("stall", 0.05)
            await bench.assert_open(ends)
            bench.relay.outage("stall", FOREVER_S)
            bench.relay.outage("none")
            await bench.assert_open(ends)

    run(scenario)


@pytest.mark.parametrize("duration_s", [0.0, -1.0, math.nan, math.inf])
def test_an_outage_without_a_sensible_duration_is_refused(run, linked, duration_s):
    async def scenario() -> None:
        async with linked() as bench:
            with pytest.raises(InvalidConfiguration, match="duration_s"):
                bench.relay.outage("stall", duration_s)
            assert bench.relay.status()["outage"]["kind"] == "none"

    run(scenario)
