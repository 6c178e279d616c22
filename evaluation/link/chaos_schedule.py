"""Faults of one run: a link and a list of mishaps, all drawn from one seed."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random
from typing import Literal

from farhand.common.impairment.impairment import DirectionSettings, Distribution, LinkSettings
from farhand.common.impairment.timeline import Timeline, TimelineStep

DURATION_S = 20.0
MishapKind = Literal["stall", "cut", "silent", "frozen", "robot restarts", "console restarts"]
_KINDS: tuple[MishapKind, ...] = ("stall", "cut", "silent", "frozen", "robot restarts", "console restarts")
_CALM_S = 2.0
"""Time before which only the link is bad, or most runs would never begin [s]."""
_DISTRIBUTIONS: tuple[Distribution, ...] = ("uniform", "normal", "pareto", "paretonormal")


@dataclass(frozen=True)
class Mishap:
    """Fault that lasts for a while.

    Args:
        kind: Kind: the link stalls or is cut, the operator does nothing, the console hangs, a side
            restarts.
        at_s: Time of its beginning [s].
        duration_s: Duration [s].
    """

    kind: MishapKind
    at_s: float
    duration_s: float


@dataclass(frozen=True)
class Schedule:
    """Schedule of one run.

    Args:
        timeline: Link over time.
        mishaps: Further faults.
    """

    timeline: Timeline
    mishaps: tuple[Mishap, ...]


def random_schedule(seed: int) -> Schedule:
    """Draw the schedule of a seed."""
    random = Random(f"schedule {seed}")
    base = LinkSettings(uplink=_direction(random, seed), downlink=_direction(random, seed))
    times_s = sorted(random.uniform(0.0, DURATION_S) for _ in range(random.randint(0, 3)))
    steps = tuple(
        TimelineStep(at_s=at_s, uplink=_change(random, base.uplink), downlink=_change(random, base.downlink))
        for at_s in times_s
    )
    mishaps = [
        Mishap(random.choice(_KINDS), random.uniform(_CALM_S, DURATION_S), random.uniform(0.3, 6.0))
        for _ in range(random.randint(0, 5))
    ]
    return Schedule(Timeline(base, steps), tuple(sorted(mishaps, key=lambda mishap: mishap.at_s)))


def _direction(random: Random, seed: int) -> DirectionSettings:
    delay_ms = random.choice([random.uniform(0, 50), random.uniform(50, 400), random.uniform(400, 1500)])
    bursty, lossy = random.random() < 0.25, random.random() < 0.5
    return DirectionSettings(
        delay_ms=delay_ms,
        jitter_ms=random.choice([0.0, random.uniform(0.0, 0.5) * delay_ms]),
        correlation=random.choice([0.0, random.uniform(0.0, 95.0)]),
        distribution=random.choice(_DISTRIBUTIONS),
        loss=random.uniform(0.0, 20.0) if lossy and not bursty else 0.0,
        loss_correlation=random.choice([0.0, random.uniform(0.0, 80.0)]),
        gemodel_p=random.uniform(0.1, 5.0) if bursty else 0.0,
        gemodel_r=random.uniform(5.0, 50.0),
        duplicate=random.choice([0.0, random.uniform(0.0, 20.0)]),
        reorder=random.choice([0.0, random.uniform(0.0, 20.0)]),
        rate_bps=random.choice([0.0, 0.0, random.uniform(30e3, 1e6)]),
        seed=seed,
    )


def _change(random: Random, base: DirectionSettings) -> dict[str, bool | int | float | str]:
    if random.random() < 0.3:
        return {}
    delay_ms = random.uniform(0.0, 1500.0)
    jitter_ms = min(base.jitter_ms, delay_ms)
    return {"delay_ms": delay_ms, "jitter_ms": jitter_ms, "duplicate": random.uniform(0.0, 30.0)}
