"""The relay between real sockets: what it carries, when, and how it stops a sender.

Times are only ever bounded from below; the rest waits for events.
"""

from __future__ import annotations

import asyncio
import random
from typing import Any

import pytest

from farhand.common.impairment.impairment import DirectionSettings, LinkSettings

FOREVER_S = 3600.0


def both_ways(**fields: Any) -> LinkSettings:
    return LinkSettings(uplink=DirectionSettings(**fields), downlink=DirectionSettings(**fields))


@pytest.mark.parametrize(
    "settings",
    [
        LinkSettings(),
        both_ways(delay_ms=20, jitter_ms=15),
        both_ways(delay_ms=5, jitter_ms=2, distribution="normal", rate_bps=40e6, queue_bytes=3000),
    ],
)
def test_every_byte_arrives_in_order_both_ways(run, linked, settings):
    chance = random.Random(5)
    payloads = [chance.randbytes(500_000), chance.randbytes(400_000)]

    async def send(writer: asyncio.StreamWriter, data: bytes) -> None:
        while data:
            size = chance.choice([1, 50, 1400, 60_000])
            writer.write(data[:size])
            data = data[size:]
            await writer.drain()
        writer.write_eof()

    async def scenario() -> None:
        async with linked(settings) as bench:
            (local_reader, local_writer), (remote_reader, remote_writer) = await bench.dial()
            received = await asyncio.gather(
                remote_reader.read(),
                local_reader.read(),
                send(local_writer, payloads[0]),
                send(remote_writer, payloads[1]),
            )
            assert received[:2] == payloads
            await bench.until(lambda status: status["connections"] == 0)
            status = bench.relay.status()
            assert status["uplink"]["delivered_bytes"] == 500_000
            assert status["downlink"]["delivered_bytes"] == 400_000
            assert status["uplink"]["lateness_p99_ms"] >= status["uplink"]["lateness_p50_ms"] >= 0

    run(scenario)


def test_the_relay_delays_each_direction_by_its_own_delay(run, linked):
    async def scenario() -> None:
        settings = LinkSettings(
            uplink=DirectionSettings(delay_ms=150), downlink=DirectionSettings(delay_ms=300)
        )
        now = asyncio.get_running_loop().time
        async with linked(settings) as bench:
            local, remote = await bench.dial()
            for (_, writer), (reader, _), delay_s in ((local, remote, 0.15), (remote, local, 0.3)):
                sent_s = now()
                writer.write(b"x")
                await reader.readexactly(1)
                assert now() - sent_s >= delay_s

    run(scenario)


def test_the_rate_holds(run, linked):
    async def scenario() -> None:
        now = asyncio.get_running_loop().time
        async with linked(both_ways(rate_bps=800_000)) as bench:
            (_, local_writer), (remote_reader, _) = await bench.dial()
            sent_s = now()
            local_writer.write(bytes(30_000))
            await remote_reader.readexactly(30_000)
            assert now() - sent_s >= 0.3

    run(scenario)


def test_a_full_queue_stops_the_sender(run, linked):
    queue_bytes, total = 20_000, 48 * 2**20  # far more than any kernel buffers

    async def scenario() -> None:
        async with linked(both_ways(queue_bytes=queue_bytes)) as bench:
            (_, local_writer), (remote_reader, _) = await bench.dial()
            bench.relay.outage("stall", FOREVER_S)
            local_writer.write(bytes(total))
            sending = asyncio.create_task(local_writer.drain())

            def queued() -> int:
                return bench.relay.status()["uplink"]["queued_bytes"]

            await bench.until(lambda status: status["uplink"]["queued_bytes"] == queue_bytes)
            assert not sending.done()
            bench.relay.clear()
            received = 0
            while received < total:
                received += len(await remote_reader.read(2**20))
                assert queued() <= queue_bytes
            await sending

    run(scenario)


def test_a_receiver_who_does_not_read_stops_the_sender(run, linked):
    async def scenario() -> None:
        async with linked(both_ways(queue_bytes=20_000)) as bench:
            (_, local_writer), (remote_reader, _) = await bench.dial()
            local_writer.write(bytes(48 * 2**20))
            sending = asyncio.create_task(local_writer.drain())
            await bench.until(lambda status: status["uplink"]["queued_bytes"] == 20_000)
            assert not sending.done()
            while not sending.done():
                await remote_reader.read(2**20)

    run(scenario)


def test_settings_change_under_a_running_connection(run, linked):
    async def scenario() -> None:
        now = asyncio.get_running_loop().time
        async with linked() as bench:
            (_, local_writer), (remote_reader, _) = await bench.dial()
            local_writer.write(b"a")
            assert await remote_reader.readexactly(1) == b"a"
            bench.relay.change(both_ways(delay_ms=200), "slow")
            assert bench.relay.status()["profile"] == "slow"
            assert bench.relay.status()["settings"]["uplink"]["delay_ms"] == 200
            sent_s = now()
            local_writer.write(b"b")
            await bench.until(lambda status: status["uplink"]["queued_bytes"] == 1)
            bench.relay.change(LinkSettings())
            local_writer.write(b"c")  # faster, but not before b
            assert await remote_reader.readexactly(2) == b"bc"
            assert now() - sent_s >= 0.2

    run(scenario)


def test_a_larger_queue_lets_a_waiting_sender_go_on(run, linked):
    async def scenario() -> None:
        async with linked(both_ways(delay_ms=600_000, queue_bytes=100)) as bench:
            (_, local_writer), _ = await bench.dial()
            local_writer.write(bytes(1000))
            await bench.until(lambda status: status["uplink"]["queued_bytes"] == 100)
            bench.relay.change(both_ways(delay_ms=600_000, queue_bytes=900))
            await bench.until(lambda status: status["uplink"]["queued_bytes"] == 900)

    run(scenario)


def test_a_queue_shorter_than_rate_times_delay_is_warned_of(run, linked, caplog):
    async def scenario() -> None:
        async with linked() as bench:
            bench.relay.change(both_ways(delay_ms=1000, rate_bps=8e6, queue_bytes=1000))
            assert "uplink: queue_bytes 1000 is less than rate times delay (1000000)" in caplog.text

    run(scenario)
