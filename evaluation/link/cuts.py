"""Planar job while the link is cut: how many executions that succeed without the cut are lost by it.

Each seed is a hand, a place where the robot starts, a phase of the target, a link of 0 to 0.5 s one way with
jitter, and a cut: when the operator sees a random part of the motion done, for 1 to 60 s, by a stall (all
that was held arrives afterwards), a reset (connections break at once) or a blackhole (everything is
swallowed, and the connections break at its end). The scripted operator of `farhand demo` does the whole job
in virtual time, without and with the cut: it demonstrates, sends, drives, previews, executes, waits for the
link, asks the robot for its report, clutches and disarms (`cuts-real`: the same with real processes). Success
is that of the task: the RMS distance to the true target over the 10 s after the arrival is below 1 % of the
board, and every command up to Disarm was done.
"""

from __future__ import annotations

import logging
import tempfile
from collections import Counter
from pathlib import Path
from random import Random
from typing import Any, get_args

import numpy as np
from msgspec import structs

from farhand.common.errors import FarhandError
from farhand.common.impairment.impairment import DirectionSettings, LinkSettings
from farhand.common.task import TaskSet
from farhand.deploy.places import find_point_task
from farhand.evaluation.harness.virtual_job import do_job
from farhand.evaluation.harness.virtual_sites import VirtualSites
from farhand.evaluation.metrics.tables import rate, table, wilson_interval
from farhand.evaluation.study import reporting_seeds
from farhand.local_site.script.scripted_actions import OutageKind, PlannedOutage
from farhand.local_site.teaching.library import Library
from farhand.remote_site.config import RemoteConfig

Case = dict[str, Any]

KINDS: tuple[OutageKind, ...] = get_args(OutageKind)
LOST_OF_200 = 4
_TRIALS = 200
_START_STD_M = 0.05
_MARGIN_M = 0.05


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one cut per seed."""
    return [_draw(each, number) for number, each in enumerate(reporting_seeds(seed, trials or _TRIALS))]


def _draw(seed: int, number: int) -> Case:
    random = Random(f"cut {seed}")
    return {
        "seed": seed,
        "kind": KINDS[number % len(KINDS)],
        "duration_s": random.uniform(1.0, 60.0),
        "at": random.uniform(0.0, 1.0),
        "delay_s": random.uniform(0.0, 0.5),
    }


def trial(case: Case) -> Case:
    """Run one seed without and with its cut."""
    logging.disable(logging.WARNING)
    try:
        uncut, cut = _virtually(case, None), _virtually(case, _outage(case))
    finally:
        logging.disable(logging.NOTSET)
    return {**case, "uncut": uncut, "cut": cut, "lost": uncut["success"] and not cut["success"]}


def _outage(case: Case) -> PlannedOutage:
    return PlannedOutage(case["kind"], case["duration_s"], case["at"])


def _virtually(case: Case, outage: PlannedOutage | None) -> Case:
    seed, task = case["seed"], find_point_task("planar")
    random = np.random.default_rng([seed, 3])
    near = np.array(task.samples[random.integers(len(task.samples))].waypoints_m[0])
    start = np.clip(near + random.normal(0.0, _START_STD_M, 2), _MARGIN_M, 1.0 - _MARGIN_M)
    task = structs.replace(task, start_m=tuple(start.tolist()))
    way = DirectionSettings(delay_ms=1e3 * case["delay_s"], jitter_ms=50.0 * case["delay_s"], seed=seed)
    settings = LinkSettings(uplink=way, downlink=structs.replace(way, seed=seed + 1))
    with tempfile.TemporaryDirectory(prefix="farhand-cuts-") as folder:
        sites = VirtualSites(Library(TaskSet([task]), Path(folder)), settings, RemoteConfig(seed=seed))
        try:
            return told(do_job(sites, settings, outage, seed))
        except FarhandError as error:
            return {"success": False, "why": str(error)}


def told(result: Case) -> Case:
    """Reduce the result of a job to the recorded figures."""
    rms_m = result["execution"]["rms_error_m"]
    return {
        "success": result["success"],
        "why": "" if result["success"] else f"the RMS error was {rms_m} m",
        "rms_error_m": rms_m,
        "ended_s": result["events"][-1]["time_s"],
        "cut_in": result.get("cut_in", ""),
    }


def described(case: Case) -> str:
    """Describe the cut in words."""
    return f"{case['kind']} for {case['duration_s']:.1f} s after {case['at']:.0%} of the motion"


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Count the lost executions by kind of cut."""
    begun = [result for result in results if result["uncut"]["success"]]
    lost = [result for result in begun if result["lost"]]
    cut_in = Counter(result["cut"].get("cut_in", "") for result in results)
    summary = {
        "trials": len(results),
        "succeed_uncut": len(begun),
        "lost": len(lost),
        "lost_seeds": [result["seed"] for result in lost],
        "lost_rate_interval": wilson_interval(len(lost), len(begun)),
        "cut_in": cut_in,
        "passed": len(lost) <= LOST_OF_200 * len(results) / _TRIALS,
    }
    groups = [(kind, [result for result in begun if result["kind"] == kind]) for kind in KINDS]
    rows = [(kind, rate([not each["lost"] for each in part])) for kind, part in [*groups, ("all", begun)]]
    lines = [
        "# The job while the link is cut", "", _TEXT, "",
        f"{len(begun)} of {len(results)} jobs succeed without a cut; {len(lost)} of those are lost by it "
        f"(at most {LOST_OF_200} of {_TRIALS} may be).", "",
        table(("cut", "kept of those that succeed uncut"), rows), "",
        "What the robot was doing when the link was cut: "
        + ", ".join(f"{phase.lower()} {n}" for phase, n in sorted(cut_in.items())) + ".",
    ]  # fmt: skip
    failed = [("lost", result, result["cut"]) for result in lost]
    failed += [("fails uncut", each, each["uncut"]) for each in results if not each["uncut"]["success"]]
    lines += [f"- {what}: seed {case['seed']}, {described(case)}: {job['why']}" for what, case, job in failed]
    return summary, "\n".join(lines)


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()
