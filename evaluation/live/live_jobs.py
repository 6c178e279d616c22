"""Whole jobs of `farhand demo` with real processes, some concurrently, and their outcomes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from farhand.common.errors import FarhandError
from farhand.common.impairment.link_profile import find_profile, load_profiles
from farhand.deploy.link.link_process import PROFILES_FILE
from farhand.evaluation.harness.real_sites import RealSites
from farhand.evaluation.link.link_delay import scheduling
from farhand.evaluation.link.profile_jobs import rate_bps
from farhand.evaluation.metrics.tables import rate, table

Case = dict[str, Any]

_AT_ONCE = 2
_NUMBERS = ("duration_s", "depth_m", "lateral_m", "peak_force_n", "holding_force_n", "control_overruns")


def job(
    task: str, seed: int, profile: str = "geo", delay_s: float | None = None, outage: str = "none"
) -> Case:
    """Return a job to be done.

    Args:
        task: Name of the task.
        seed: Seed of everything.
        profile: Profile of the link.
        delay_s: One-way delay, instead of the profile's [s].
        outage: As on the command line.
    """
    return {"task": task, "seed": seed, "profile": profile, "delay_s": delay_s, "outage": outage}


def run_jobs(jobs: Sequence[Case]) -> Case:
    """Run all jobs; each has `success` afterwards, and `why` if it failed."""
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        done = list(pool.map(_run, jobs))
    return {"jobs": done, "scheduling": scheduling(), "load": os.getloadavg()[0]}


def _run(case: Case) -> Case:
    carries_bps = rate_bps(find_profile(load_profiles(PROFILES_FILE), case["profile"]))
    try:
        with RealSites(
            case["delay_s"], with_console=False, task=case["task"], seed=case["seed"], profile=case["profile"],
            rate_bps=carries_bps,
        ) as sites:  # fmt: skip
            result = sites.run_demo(case["outage"])
    except FarhandError as error:
        return {**case, "success": False, "why": str(error)}
    execution = {name: result["execution"][name] for name in _NUMBERS}
    why = "" if result["success"] else f"it ended {execution}"
    return {
        **case, "success": result["success"], "why": why, "execution": execution,
        "model_sha256": result["model_sha256"], "took_s": result["events"][-1]["time_s"],
        "command_round_trip_s": result["link"]["command_round_trip_s"],
    }  # fmt: skip


def job_table(groups: Sequence[tuple[str, Sequence[Case]]]) -> str:
    """Make one row per group of jobs: successes, and how the plug sat."""
    return table(
        (
            "jobs", "done", "depth min, median, max mm", "off the axis max mm", "peak force median, max N",
            "held with median N", "arrived after median s", "late periods median",
        ),
        [(name, rate([each["success"] for each in part]), *_ended(part)) for name, part in groups],
    )  # fmt: skip


def footnotes(result: Case) -> list[str]:
    """State the processes' settings, and the reasons of failures."""
    lines = [
        "",
        f"Two jobs at a time. Scheduled with {result['scheduling']}; load of the machine {result['load']:.1f}.",
    ]
    return lines + [
        f"- seed {each['seed']}, {each['profile']}, {each['outage']}: {each['why']}"
        for each in result["jobs"]
        if not each["success"]
    ]


def _ended(jobs: Sequence[Case]) -> tuple[str, ...]:
    ended = [each["execution"] for each in jobs if "execution" in each]
    if not ended:
        return ("",) * 6
    of = {name: np.array([each[name] for each in ended], dtype=float) for name in _NUMBERS}
    depth, lateral = 1e3 * of["depth_m"], 1e3 * of["lateral_m"]
    peak = of["peak_force_n"]
    return (
        f"{depth.min():.1f}, {np.median(depth):.1f}, {depth.max():.1f}",
        f"{lateral.max():.1f}",
        f"{np.median(peak):.0f}, {peak.max():.0f}",
        f"{np.nanmedian(of['holding_force_n']):.0f}",
        f"{np.nanmedian(of['duration_s']):.1f}",
        f"{np.nanmedian(of['control_overruns']):.0f}",
    )
