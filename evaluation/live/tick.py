"""Control periods of the live arm for ten minutes, with all processes on this machine.

Robot, simulated link (`geo`), an operator's site with its page, and one job of `farhand demo` after the other:
taught, sent, driven, executed with contact. The robot itself takes the processor time of its control thread and
how late each period began, and writes both down once a minute; those are the lines here. A period that is late
by more than a period is left out, never made up for.
"""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import Any

from farhand.common.impairment.link_profile import find_profile, load_profiles
from farhand.deploy.link.link_process import PROFILES_FILE
from farhand.evaluation.harness.real_sites import RealSites
from farhand.evaluation.link.link_delay import scheduling
from farhand.evaluation.link.profile_jobs import rate_bps
from farhand.evaluation.metrics.tables import rate, table

Case = dict[str, Any]

CPU_P99_LIMIT_MS = 5.0
_PROFILE, _MINUTES = "geo", 10
_TIMES = [f"{what}_{part}_ms" for what in ("cpu", "late") for part in ("p50", "p99", "max")]


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one case; `trials` is its length in minutes."""
    return [{"task": "hot-stab", "seed": seed, "duration_s": 60.0 * (trials or _MINUTES)}]


def trial(case: Case) -> Case:
    """Run jobs until the time is over; the last one is cut off."""
    carries_bps = rate_bps(find_profile(load_profiles(PROFILES_FILE), _PROFILE))
    succeeded, loads = [], []
    with RealSites(
        None, with_console=False, task=case["task"], seed=case["seed"], profile=_PROFILE, rate_bps=carries_bps
    ) as sites:
        page = sites.start_page()
        ends_s = time.monotonic() + case["duration_s"]
        while time.monotonic() < ends_s:
            job = sites.start_demo()
            status = job.wait(max(ends_s - time.monotonic(), 0.0))
            if status is None:
                job.kill()
            else:
                succeeded.append(status == 0)
            loads.append(os.getloadavg()[0])
        page.kill()
        sites.robot.end()  # it writes an incomplete minute at its end
        lines = tick_lines(sites.robot_events)
    # A quantile of the few periods at the end says little, unless there are no others.
    minutes = [line for line in lines if line["n"] == lines[0]["n"]]
    return {**case, "minutes": minutes, "succeeded": succeeded, "loads": loads, "scheduling": scheduling()}


def tick_lines(events: Path) -> list[Case]:
    """Read a robot's records of its control periods, one dictionary per minute."""
    lines = [json.loads(line) for line in events.read_text(encoding="utf-8").splitlines()]
    return [line for line in lines if line["kind"] == "ticks"]


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Tabulate each minute, and the worst: no quantile of all periods is above the worst minute's."""
    (result,) = results
    minutes = result["minutes"]
    worst = {name: max(minute[name] for minute in minutes) for name in _TIMES}
    n, overruns = sum(minute["n"] for minute in minutes), minutes[-1]["overruns"]
    passed = worst["cpu_p99_ms"] <= CPU_P99_LIMIT_MS
    summary = {
        **worst,
        "periods": n,
        "left_out": overruns,
        "jobs": len(result["succeeded"]),
        "passed": passed,
    }
    header = (
        "minute", "periods", "left out until then", "processor p50", "p99", "max ms", "late p50", "p99", "max ms",
    )  # fmt: skip
    rows: list[tuple[object, ...]] = [
        (number, minute["n"], minute["overruns"], *(minute[name] for name in _TIMES))
        for number, minute in enumerate(minutes, start=1)
    ]
    rows.append(("worst", n, overruns, *worst.values()))
    lines = [
        "# Control periods of the live arm",
        "",
        _TEXT,
        "",
        f"Processor time p99 at most {CPU_P99_LIMIT_MS:g} ms in every minute: {'yes' if passed else 'NO'}.",
        "",
        table(header, rows),
        "",
        f"Jobs that succeeded: {rate(result['succeeded'])}. Scheduled with {result['scheduling']}; load of the machine "
        f"{min(result['loads']):.1f} to {max(result['loads']):.1f}, on {os.cpu_count()} cores.",
    ]
    return summary, "\n".join(lines)


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()
