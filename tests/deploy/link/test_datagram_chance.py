"""What chance does to datagrams between real UDP sockets: lost, duplicated, corrupted, overtaken.

Each share is held against the theory of its model, within four standard errors; the losses of a seed against the
model itself.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from random import Random
from typing import Any

import pytest

from farhand.common.impairment.burst_loss import Loss
from farhand.common.impairment.impairment import DirectionSettings

N = 3000
BURST = 50


def near(share: float, n: int) -> Any:
    return pytest.approx(share, abs=4 * math.sqrt(share * (1 - share) / n))


@pytest.mark.parametrize("loss", [5.0, 20.0])
def test_independent_losses_have_their_share_and_no_memory(run, udp, loss):
    async def scenario() -> None:
        async with udp({"loss": loss, "seed": 3}) as bench:
            await bench.send(N)
            arrived = bench.numbers()
            assert arrived == sorted(set(arrived))
            p = loss / 100
            assert 1 - len(arrived) / N == near(p, N)
            missing = [k not in set(arrived) for k in range(N)]
            pairs = sum(a and b for a, b in itertools.pairwise(missing))
            assert pairs == pytest.approx(p * p * N, abs=4 * math.sqrt(p * p * N))
            assert bench.tally()["lost"] == sum(missing)

    run(scenario)


def test_gilbert_elliott_loses_in_bursts_of_its_length(run, udp):
    p, r = 0.05, 0.25

    async def scenario() -> None:
        async with udp({"gemodel_p": 100 * p, "gemodel_r": 100 * r, "seed": 5}) as bench:
            await bench.send(N)
            arrived = set(bench.numbers())
            lost = [k not in arrived for k in range(N)]
            lengths = [len(list(group)) for is_lost, group in itertools.groupby(lost) if is_lost]
            mean = sum(lengths) / len(lengths)
            assert mean == pytest.approx(1 / r, abs=4 * math.sqrt((1 - r) / r**2 / len(lengths)))
            assert len(lengths) / N == pytest.approx(p * r / (p + r), rel=4 / math.sqrt(len(lengths)))

    run(scenario)


def test_the_relay_loses_what_the_in_process_link_loses_for_the_same_seed(run, udp):
    direction = {"loss": 30.0, "loss_correlation": 40.0, "seed": 9}

    async def scenario() -> None:
        async with udp(direction) as bench:
            await bench.send(400)
            model = Loss(DirectionSettings(**direction), Random("9/0/uplink/loss"))
            assert bench.numbers() == [k for k in range(400) if not model.is_lost()]

    run(scenario)


def test_duplicates_come_at_their_rate_each_the_same(run, udp):
    async def scenario() -> None:
        async with udp({"duplicate": 10.0, "seed": 2}) as bench:
            await bench.send(N)
            copies = Counter(bench.numbers())
            assert set(copies) == set(range(N))
            assert set(copies.values()) == {1, 2}
            assert sum(n == 2 for n in copies.values()) / N == near(0.1, N)

    run(scenario)


def test_corrupted_datagrams_differ_in_one_bit_and_the_others_in_none(run, udp):
    async def scenario() -> None:
        async with udp({"corrupt": 10.0, "seed": 4}) as bench:
            await bench.send(N, lambda k: k.to_bytes(4, "big") * 10)
            differing = [
                (int.from_bytes(data, "big") ^ int.from_bytes(k.to_bytes(4, "big") * 10, "big")).bit_count()
                for k, data in enumerate(bench.remote.heard)
            ]
            assert len(differing) == N
            assert set(differing) == {0, 1}
            assert sum(differing) / N == near(0.1, N)

    run(scenario)


def test_reordered_datagrams_overtake_those_that_were_sent_before(run, udp):
    async def scenario() -> None:
        async with udp({"delay_ms": 100.0, "reorder": 20.0, "seed": 6}) as bench:
            await bench.send(BURST)  # one burst: all are under way together
            arrived = bench.numbers()
            assert sorted(arrived) == list(range(BURST))
            overtakers = arrived[
                : next(k for k in range(BURST) if arrived[k] == min(set(range(BURST)) - set(arrived[:k])))
            ]
            assert overtakers == sorted(overtakers)
            assert 0 < len(overtakers) < BURST / 2
            assert arrived == overtakers + sorted(set(arrived) - set(overtakers))

    run(scenario)
