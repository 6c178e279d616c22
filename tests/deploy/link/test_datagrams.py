"""The relay between real UDP sockets: what it carries, when, from where, and what an outage does to it.

Times are only ever bounded from below.
"""

from __future__ import annotations

import asyncio
from random import Random

import pytest

from farhand.common.impairment.impairment import DirectionSettings, LinkSettings

HOST = "127.0.0.1"
FOREVER_S = 3600.0
BURST = 50


def test_a_clean_relay_carries_every_datagram_whole_and_in_order_both_ways(run, udp):
    async def scenario() -> None:
        async with udp() as bench:
            chance = Random(1)
            sent = [chance.randbytes(chance.choice([1, 264, 1200, 1472])) for _ in range(300)]
            await bench.send(len(sent), lambda k: sent[k])
            assert bench.remote.heard == sent
            assert len(set(bench.remote.senders)) == 1
            for data in sent[:40]:
                bench.remote.transport.sendto(data, bench.remote.senders[0])
            await bench.local.until_heard(40)
            assert bench.local.heard == sent[:40]
            assert set(bench.local.senders) == {bench.relay.address}
            assert bench.tally() == {
                "taken": 300, "delivered": 300, "lost": 0, "duplicated": 0, "corrupted": 0, "overflowed": 0,
            }  # fmt: skip

    run(scenario)


def test_each_direction_has_its_own_delay_and_jitter(run, udp):
    async def scenario() -> None:
        now = asyncio.get_running_loop().time
        async with udp({"delay_ms": 150.0}, {"delay_ms": 300.0, "jitter_ms": 100.0}) as bench:
            sent_s = now()
            bench.local.transport.sendto(b"up")
            await bench.remote.until_heard(1)
            assert now() - sent_s >= 0.15
            sent_s = now()
            for k in range(BURST):
                bench.remote.transport.sendto(k.to_bytes(4, "big"), bench.remote.senders[0])
            await bench.local.until_heard(BURST)
            assert min(bench.local.times_s) - sent_s >= 0.2
            assert max(bench.local.times_s) - sent_s >= 0.35  # of 50 between 0.2 and 0.4 s
            assert bench.local.heard == sorted(bench.local.heard)  # packets of one path queue up

    run(scenario)


def test_the_rate_counts_headers_and_a_full_queue_drops_the_newest(run, udp):
    async def scenario() -> None:
        # 100 B with 28 B of headers at 12,800 B/s: one each 10 ms; room for ten.
        async with udp({"rate_bps": 8 * 12_800.0, "queue_bytes": 1280}) as bench:
            sent_s = asyncio.get_running_loop().time()
            for k in range(20):
                bench.local.transport.sendto(k.to_bytes(4, "big") * 25)
            await bench.until(lambda status: status["uplink"]["datagrams"]["taken"] == 20)
            dropped = bench.tally()["overflowed"]
            await bench.remote.until_heard(20 - dropped)
            arrived = [int.from_bytes(data[:4], "big") for data in bench.remote.heard]
            assert arrived[:10] == list(range(10))
            assert 0 < dropped <= 10
            assert bench.remote.times_s[9] - sent_s >= 0.1

    run(scenario)


def test_a_stall_holds_datagrams_and_delivers_them_afterwards_in_order(run, udp):
    async def scenario() -> None:
        async with udp() as bench:
            bench.relay.outage("stall", FOREVER_S)
            for k in range(10):
                bench.local.transport.sendto(k.to_bytes(4, "big"))
            await bench.until(lambda status: status["uplink"]["queued_bytes"] == 40)
            assert bench.remote.heard == []
            bench.relay.clear()
            await bench.remote.until_heard(10)
            assert bench.numbers() == list(range(10))

    run(scenario)


@pytest.mark.parametrize("kind", ["blackhole", "reset"])
def test_an_outage_loses_what_is_under_way_and_what_comes_and_then_carries_again(run, udp, kind):
    async def scenario() -> None:
        async with udp({"delay_ms": 50.0}) as bench:
            await bench.send(1)
            bench.local.transport.sendto(b"under way")
            await bench.until(lambda status: status["uplink"]["queued_bytes"] == 9)
            bench.relay.outage(kind, FOREVER_S)
            bench.local.transport.sendto(b"lost")
            bench.remote.transport.sendto(b"lost too", bench.remote.senders[0])
            await bench.until(
                lambda status: (
                    (status["uplink"]["swallowed_bytes"], status["downlink"]["swallowed_bytes"]) == (13, 8)
                )
            )
            bench.relay.clear()
            bench.local.transport.sendto(b"after")
            await bench.remote.until_heard(2)
            assert bench.remote.heard[1] == b"after"
            assert (bench.remote.senders[1] != bench.remote.senders[0]) is (kind == "reset")

    run(scenario)


def test_after_a_rebind_the_remote_site_hears_the_sender_at_another_port_and_answers_there(run, udp):
    async def scenario() -> None:
        async with udp({"delay_ms": 30.0}) as bench:
            await bench.send(3)
            bench.local.transport.sendto(b"under way")
            await bench.until(lambda status: status["uplink"]["queued_bytes"] == 9)
            bench.relay.rebind()
            await bench.remote.until_heard(4)
            before, after = bench.remote.senders[2], bench.remote.senders[3]
            assert before != after
            assert bench.remote.heard[3] == b"under way"
            bench.remote.transport.sendto(b"to nobody", before)
            bench.remote.transport.sendto(b"answer", after)
            await bench.local.until_heard(1)
            assert bench.local.heard == [b"answer"]
            assert (bench.relay.status()["rebinds"], bench.relay.status()["transport"]) == (1, "udp")

    run(scenario)


def test_senders_are_told_apart(run, udp):
    async def scenario() -> None:
        async with udp() as bench:
            other = type(bench.local)()
            await other.open(bench.relay.address)
            bench.local.transport.sendto(b"one")
            await bench.remote.until_heard(1)
            other.transport.sendto(b"two")
            await bench.remote.until_heard(2)
            for k, sender in enumerate(bench.remote.senders):
                bench.remote.transport.sendto(b"to %d" % k, sender)
            await bench.local.until_heard(1)
            await other.until_heard(1)
            assert (bench.local.heard, other.heard) == ([b"to 0"], [b"to 1"])
            assert bench.relay.status()["connections"] == 2
            other.transport.abort()

    run(scenario)


def test_settings_change_while_datagrams_are_under_way(run, udp):
    async def scenario() -> None:
        async with udp({"delay_ms": 200.0}) as bench:
            bench.local.transport.sendto(b"slow")
            await bench.until(lambda status: status["uplink"]["queued_bytes"] == 4)
            bench.relay.change(LinkSettings())
            bench.local.transport.sendto(b"fast")
            await bench.remote.until_heard(2)
            assert bench.remote.heard == [b"fast", b"slow"]
            bench.relay.change(LinkSettings(uplink=DirectionSettings(loss=100)))
            await_lost = bench.tally()["lost"] + 1
            bench.local.transport.sendto(b"lost")
            await bench.until(lambda status: status["uplink"]["datagrams"]["lost"] == await_lost)

    run(scenario)


def test_nobody_at_the_target_is_told_until_somebody_answers(run, udp):
    async def scenario() -> None:
        async with udp() as bench:
            address = bench.remote.transport.get_extra_info("sockname")
            bench.remote.transport.close()
            await asyncio.sleep(0)

            async def until_refused() -> None:
                while not bench.relay.status()["target_error"]:
                    bench.local.transport.sendto(b"?")
                    await asyncio.sleep(0.01)

            await until_refused()
            assert bench.relay.status()["target_error"] == "Connection refused"
            again = type(bench.remote)()
            again.transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(
                lambda: again, local_addr=address
            )
            bench.local.transport.sendto(b"there?")
            await again.until_heard(1)
            again.transport.sendto(b"here", again.senders[0])
            await bench.local.until_heard(1)
            assert bench.relay.status()["target_error"] == ""
            again.transport.abort()

    run(scenario)


def test_a_tcp_connection_says_what_it_ignores(run, linked, caplog):
    async def scenario() -> None:
        settings = LinkSettings(downlink=DirectionSettings(loss=10, duplicate=1))
        async with linked(settings) as bench:
            assert bench.relay.status()["streams_ignore"] == []
            assert bench.relay.status()["transport"] == ""
            await bench.assert_open(await bench.dial())
            assert bench.relay.status()["transport"] == "tcp"
            assert bench.relay.status()["streams_ignore"] == ["downlink.loss", "downlink.duplicate"]
            assert "carried without downlink.loss, downlink.duplicate: TCP repairs them" in caplog.text

    run(scenario)
