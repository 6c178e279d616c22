"""Chaos of one run, drawn from one seed: faults of the link, mishaps, an operator at random, and an attacker."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from random import Random
from typing import Literal

import msgspec

from farhand.common.impairment.impairment import DirectionSettings, Distribution, LinkSettings
from farhand.common.impairment.link_profile import LinkTimeline, TimelineStep
from farhand.common.impairment.virtual_direction import Packet
from farhand.common.mode_table import Action, ControlMode, allowed_actions
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import Command, Wish
from farhand.evaluation.harness.virtual_sites import VirtualSites
from farhand.local_site.console import intents

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

    timeline: LinkTimeline
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
    return Schedule(LinkTimeline(base, steps), tuple(sorted(mishaps, key=lambda mishap: mishap.at_s)))


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


_HAND_PERIOD_S = 1.0 / 20.0
_MEAN_PAUSE_S = 0.35
_PREVIEW_SHARE = 0.05
"""Share of previews among the actions: one costs more computing time than a second of all the rest."""

_ENDS = (Action.STOP, Action.DISARM, Action.ABORT)


class ChaosOperator:
    """Random operator at the console.

    Args:
        sites: Both sites.
        seed: Seed of all its actions.
    """

    def __init__(self, sites: VirtualSites, seed: int):
        self._sites, self._random = sites, Random(f"operator {seed}")
        self._drag_until_s = 0.0
        self._phase = 0.0
        self._captured: deque[Packet] = deque(maxlen=200)
        self.silent = False
        """True while the operator does nothing."""
        self.done = False
        """True once the operator has gone."""
        sites.time.call_later(self._pause_s(), self._act)

    def capture(self, packet: Packet) -> None:
        """See a message on the line."""
        if packet.channel in (keys.COMMAND, keys.INPUT, keys.LEASE, keys.STOP):
            self._captured.append(packet)

    def _pause_s(self) -> float:
        return self._random.expovariate(1.0 / _MEAN_PAUSE_S)

    def _act(self) -> None:
        if self.done:
            return
        self._sites.time.call_later(self._pause_s(), self._act)
        if self._captured and self._random.random() < 0.15:
            self._sites.link.uplink.deliver(self._forged(self._random.choice(self._captured)))
        if not self.silent and not self._sites.console_frozen:
            self._operate()

    def _operate(self) -> None:
        picture = self._sites.console.picture
        chance = self._random.random()
        if not picture.confirmed_sha256 and not picture.sending_model:
            self._sites.console.submit(intents.SendModel())
        elif picture.mode is ControlMode.DIRECT and chance < 0.7:
            if self._sites.time.now_s() > self._drag_until_s:
                self._drag_until_s = self._sites.time.now_s() + self._random.uniform(0.2, 3.0)
                self._drag()
        elif chance < 0.03:
            self._sites.console.submit(intents.WishControl(self._random.choice(list(Wish))))
        elif chance < 0.08:
            self._sites.console.submit(intents.DragTarget((self._random.random(), self._random.random())))
        else:
            self._command()

    def _command(self) -> None:
        picture = self._sites.console.picture
        actions = list(Action)
        if picture.robot is not None and self._random.random() < 0.9:
            # Actions that lead somewhere are more frequent than actions that end everything.
            actions = sorted(allowed_actions(picture.robot.mode, picture.robot.phase))
            if self._random.random() < 0.92:
                actions = [action for action in actions if action not in _ENDS] or actions
        if Action.COUPLE in actions and self._random.random() < 0.3:
            actions = [Action.COUPLE]
        action = self._random.choice(actions)
        if action is not Action.PREVIEW or self._random.random() < _PREVIEW_SHARE:
            self._sites.console.submit(intents.CommandRobot(action))

    def _drag(self) -> None:
        """Move the hand until the drag ends; often without a proper release."""
        now_s = self._sites.time.now_s()
        if self.silent or self.done or self._sites.console_frozen:
            return
        self._phase += self._random.uniform(0.0, 0.4)
        position = (0.5 + 0.4 * math.sin(self._phase), 0.5 + 0.4 * math.cos(0.7 * self._phase))
        over = now_s > self._drag_until_s
        released = over and self._random.random() < 0.5
        self._sites.console.submit(intents.Hand(position, now_s, released=released))
        if not over:
            self._sites.time.call_later(_HAND_PERIOD_S, self._drag)

    def _forged(self, packet: Packet) -> Packet:
        """Replay an old message, unchanged or as another command."""
        if packet.channel is not keys.COMMAND or self._random.random() < 0.5:
            return packet
        command = decode(packet.data, Command)
        forged = msgspec.structs.replace(
            command,
            command_id=f"{self._random.getrandbits(64):016x}",
            action=self._random.choice(list(Action)),
        )
        if self._random.random() < 0.3:
            forged = msgspec.structs.replace(forged, lease_id=f"{self._random.getrandbits(64):016x}")
        return replace(packet, data=encode(forged))
