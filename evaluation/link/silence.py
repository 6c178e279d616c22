"""Silence while the operator drives: time until the robot stands, with both sites' own code in virtual time.

The operator couples and moves the hand in a circle, faster than the robot can follow, and at a random moment
the link is cut for 1 to 10 s, the page sends no more events (it is frozen, or the hand does not move), the
operator's console hangs for 1 to 10 s, or its process is killed and starts again. While the link is cut or the
console hangs the hand goes on moving, and what it did arrives at the end of a stall, or when the console goes
on. Nobody couples again: from then on the robot must stand until the end of the run.

The time counts from the cut, and for the silent ones from the arrival of the last input that was on its way.
"""

from __future__ import annotations

import functools
import logging
import math
import tempfile
from itertools import product
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from farhand.common.errors import FarhandError
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.impairment.virtual_direction import Packet
from farhand.common.mode_table import Action, ControlMode
from farhand.common.task import PointTask, Target, TaskSet
from farhand.common.wire import keys
from farhand.evaluation.harness.virtual_job import VirtualPlace
from farhand.evaluation.harness.virtual_sites import Hooks, VirtualSites
from farhand.evaluation.metrics.tables import quantiles, rate, table
from farhand.evaluation.study import reporting_seeds
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.script.scripted_actions import OutageKind
from farhand.local_site.teaching.library import Library
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.motion.coupling import INPUT_SILENCE_S
from farhand.remote_site.robots.point_embodiment import CONTROL_HZ

Case = dict[str, Any]

DELAYS_S = (0.0, 0.3, 1.0, 3.0, 5.0)
CUTS: tuple[OutageKind, ...] = ("stall", "reset", "blackhole")
KINDS: tuple[str, ...] = (*CUTS, "no events of the page", "console hangs", "console killed")
_RADIUS_M, _TURN_RAD_S, _HAND_S = 0.4, 6.0, 1.0 / 30.0
_STANDING_M_S = 2e-3
_WATCHED_S, _PATIENCE_S, _ATTEMPTS = 12.0, 60.0, 3

_TASK = PointTask(
    name="silence", n_dims=2, frame_names=("goal",), workspace_m=(1.0, 1.0), start_m=(0.9, 0.5),
    target=Target(origin_m=(0.5, 0.5), amplitude_m=(0.0, 0.0)),
)  # fmt: skip
_CONFIG = RemoteConfig()
_PERIOD_S = 1.0 / CONTROL_HZ
LIMIT_S = INPUT_SILENCE_S + _TASK.limits.speed_m_s / _TASK.limits.acceleration_m_s2 + 2.0 * _PERIOD_S
"""Bound: 0.5 s, braking from full speed, and the wait for a control period in both [s]."""


def cases(trials: int, seed: int) -> list[Case]:
    """List every kind of silence at every delay in turn, each with its own seed."""
    kinds = list(product(KINDS, DELAYS_S))
    return [
        {"silence": kinds[number % len(kinds)][0], "delay_s": kinds[number % len(kinds)][1], "seed": its_seed}
        for number, its_seed in enumerate(reporting_seeds(seed, trials))
    ]


def trial(case: Case) -> Case:
    """Run one drive to its end."""
    logging.disable(logging.WARNING)
    try:
        with tempfile.TemporaryDirectory(prefix="farhand-silence-") as folder:
            return {**case, **_Drive(case, Path(folder)).run()}
    finally:
        logging.disable(logging.NOTSET)


class _Drive:
    """Both sites, the hand, and the observer of the robot's speed."""

    def __init__(self, case: Case, folder: Path):
        self._kind, self._random = case["silence"], Random(f"silence {case['seed']}")
        delay_ms = 1e3 * case["delay_s"]
        jitter_ms = min(0.3 * delay_ms, self._random.uniform(0.0, 100.0))
        ways = [
            DirectionSettings(delay_ms=delay_ms, jitter_ms=jitter_ms, seed=case["seed"] + n) for n in (0, 1)
        ]
        settings = LinkSettings(uplink=ways[0], downlink=ways[1])
        self._sites = VirtualSites(Library(TaskSet([_TASK]), folder), settings, _CONFIG)
        self._sites.hooks = Hooks(after=self._watch)
        self._sites.link.uplink.tap = self._on_packet
        self._place = VirtualPlace(self._sites, settings)
        self._round_trip_s = 2.0 * case["delay_s"]
        self._hand_moves = True
        self._began_s = self._newest_input_s = self._moving_s = self._sites.time.now_s()
        self._silent_from_s = math.inf

    def run(self) -> Case:
        """Drive, fall silent, and measure how long the robot still moves."""
        for action, mode in ((Action.ARM, ControlMode.HOLD), (Action.COUPLE, ControlMode.DIRECT)):
            self._command(action, mode)
        self._move_hand()
        self._place.pause(self._random.uniform(3.0, 6.0) + self._round_trip_s)
        sites, now_s = self._sites, self._sites.time.now_s()
        self._silent_from_s = now_s
        coupled, speed_m_s = sites.robot.supervisor.mode is ControlMode.DIRECT, self._speed_m_s()
        duration_s = self._random.uniform(1.0, 10.0)
        self._fall_silent(duration_s)
        self._place.pause(duration_s + _WATCHED_S + self._round_trip_s)
        since_s = now_s if self._kind in CUTS else max(now_s, self._newest_input_s)
        return {
            "coupled": coupled,
            "speed_m_s": speed_m_s,
            "stood_after_s": self._moving_s - since_s,
            "mode": sites.robot.supervisor.mode.name,
        }

    def _fall_silent(self, duration_s: float) -> None:
        match self._kind:
            case "stall" | "reset" | "blackhole":
                self._place.outage(self._kind, duration_s)
            case "no events of the page":
                self._hand_moves = False
            case "console hangs":
                self._sites.console_frozen = True
                self._sites.time.call_later(
                    duration_s, functools.partial(setattr, self._sites, "console_frozen", False)
                )
            case _:
                self._sites.restart_console(duration_s)

    def _command(self, action: Action, mode: ControlMode) -> None:
        """Repeat a command until the robot has done it.

        Raises:
            FarhandError: It never did.
        """

        def refusals(picture: ConsoleState) -> int:
            return sum(notice.what == action and not notice.good for notice in picture.notices)

        def there(picture: ConsoleState) -> bool:
            return picture.mode is mode and not picture.pending

        for _ in range(_ATTEMPTS):
            self._place.wait_for(lambda picture: picture.in_control, _PATIENCE_S)
            before = refusals(self._place.picture)
            self._place.submit(intents.CommandRobot(action))
            self._place.wait_for(lambda p, n=before: there(p) or refusals(p) > n, _PATIENCE_S)
            if there(self._place.picture):
                return
        raise FarhandError(f"{action} did not lead to {mode}")

    def _move_hand(self) -> None:
        """Move the hand until it falls silent."""
        if self._hand_moves:
            angle = _TURN_RAD_S * (self._sites.time.now_s() - self._began_s)
            position_m = (_RADIUS_M * math.cos(angle), _RADIUS_M * math.sin(angle))
            self._sites.console.submit(intents.Hand(position_m, self._sites.time.now_s()))
            self._sites.time.call_later(_HAND_S, self._move_hand)

    def _on_packet(self, packet: Packet) -> None:
        if packet.channel is keys.INPUT and packet.sent_s <= self._silent_from_s:
            self._newest_input_s = self._sites.time.now_s()

    def _speed_m_s(self) -> float:
        return float(np.linalg.norm(self._sites.robot.embodiment.hardware.plant.read().velocity_m_s))

    def _watch(self) -> None:
        if self._speed_m_s() > _STANDING_M_S:
            self._moving_s = self._sites.time.now_s()


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Tabulate the time to standstill, by what fell silent and by the delay."""
    late = [r for r in results if r["stood_after_s"] > LIMIT_S]
    summary = {
        "n": len(results),
        "driving": sum(r["coupled"] and r["speed_m_s"] > _STANDING_M_S for r in results),
        "worst_s": max(r["stood_after_s"] for r in results),
        "limit_s": LIMIT_S,
        "late_seeds": [r["seed"] for r in late],
        "passed": not late,
    }
    groups = [(kind, [r for r in results if r["silence"] == kind]) for kind in KINDS]
    groups += [(f"all, {d:g} s one way", [r for r in results if r["delay_s"] == d]) for d in DELAYS_S]
    rows = [
        (name, rate([r["stood_after_s"] <= LIMIT_S for r in part]), quantiles([r["stood_after_s"] for r in part]),
         max(r["stood_after_s"] for r in part))
        for name, part in [*groups, ("all", results)] if part
    ]  # fmt: skip
    lines = [
        "## Silence", "", (__doc__ or "").split("\n", 1)[1].strip(), "",
        f"Limit: 0.5 s and braking from full speed, each from the next control period on: {LIMIT_S:.2f} s. "
        f"{summary['driving']} of {len(results)} robots were moving when it fell silent.", "",
        table(("", "within the limit", "stood after [s], median / 90 %", "worst [s]"), rows),
    ]  # fmt: skip
    return summary, "\n".join(lines)
