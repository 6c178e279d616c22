"""Planar job while the link is cut, with real processes: the first seeds of `cuts` over the real relay.

Robot, link and operator's site are processes, and the scripted operator of `farhand demo` does the whole job
in real time, from the task's own start, with the same cut as in virtual time. Some jobs run beside each other:
they wait most of the time. Success is that of the task, with every command up to Disarm done.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from farhand.common.errors import FarhandError
from farhand.evaluation.harness.real_sites import RealSites
from farhand.evaluation.link import cuts
from farhand.evaluation.link.link_delay import scheduling
from farhand.evaluation.metrics.tables import rate, table

Case = dict[str, Any]

_JOBS, _AT_ONCE = 24, 3


def cases(trials: int | None, seed: int) -> list[Case]:
    """List all jobs as one case: one process starts the others."""
    return [{"jobs": cuts.cases(trials or _JOBS, seed)}]


def trial(case: Case) -> Case:
    """Run all jobs, some of them concurrently."""
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        return {
            "jobs": list(pool.map(_job, case["jobs"])),
            "scheduling": scheduling(),
            "load": os.getloadavg()[0],
        }


def _job(case: Case) -> Case:
    outage = f"{case['kind']}:{case['duration_s']:.2f}@{case['at']:.3f}"
    try:
        with RealSites(case["delay_s"], with_console=False, seed=case["seed"]) as sites:
            return {**case, "cut": cuts.told(sites.run_demo(outage))}
    except FarhandError as error:
        return {**case, "cut": {"success": False, "why": str(error)}}


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Count the finished jobs by kind of cut."""
    jobs = results[0]["jobs"]
    failed = [job for job in jobs if not job["cut"]["success"]]
    summary = {
        "jobs": len(jobs),
        "failed_seeds": [job["seed"] for job in failed],
        "longest_cut_s": max(job["duration_s"] for job in jobs),
        "passed": not failed,
    }
    groups = [(kind, [job for job in jobs if job["kind"] == kind]) for kind in cuts.KINDS]
    rows = [(kind, rate([job["cut"]["success"] for job in part])) for kind, part in [*groups, ("all", jobs)]]
    lines = [
        "# The job while the link is cut, with real processes",
        "",
        _TEXT,
        "",
        table(("cut", "done"), rows),
    ]
    lines += ["", f"Scheduled with {results[0]['scheduling']}; load of the machine {results[0]['load']:.1f}."]
    lines += [f"- seed {job['seed']}, {cuts.described(job)}: {job['cut']['why']}" for job in failed]
    return summary, "\n".join(lines)


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()
