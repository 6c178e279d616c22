"""Whole hot-stab job over a satellite link, live: five demonstrations by the operator, then the robot's part.

Robot, link and operator's site are processes in real time. The scripted operator leads its own simulated arm
into its receptacle five times, sends what was learned over the profile `geo`, drives the robot a little,
previews and executes; the robot sees its receptacle with the noise of `typical` (bias 3 mm and 1 degree, jitter
5 mm and 2 degrees, 30 % missing, 60 ms late), touches it, and seats the plug. Success is the task's: 75 to
95 mm deep and less than 4 mm off the axis for a second, and every command up to Disarm done. The first seeds
are done twice.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from farhand.evaluation.live.live_jobs import footnotes, job, job_table, run_jobs

Case = dict[str, Any]

_JOBS, _TWICE = 20, 3


def cases(trials: int | None, seed: int) -> list[Case]:
    """List all jobs as one case: one process starts the others. `farhand demo --seed` repeats each."""
    n = trials or _JOBS
    seeds = [*range(n), *range(min(_TWICE, n))]
    return [{"jobs": [job("hot-stab", 100 * seed + number) for number in seeds]}]


def trial(case: Case) -> Case:
    """Run all jobs, two at a time."""
    return run_jobs(case["jobs"])


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Count the finished jobs, and compare the ends of two with the same seed."""
    (result,) = results
    jobs = result["jobs"]
    n = len({each["seed"] for each in jobs})
    first, again = jobs[:n], jobs[n:]
    same = [_alike(one, other) for one in first for other in again if one["seed"] == other["seed"]]
    apart_m = [apart for _, apart in same if apart is not None]
    summary = {
        "jobs": n,
        "success_rate": float(np.mean([each["success"] for each in first])),
        "failed_seeds": [each["seed"] for each in first if not each["success"]],
        "same_verdict_and_model": all(alike for alike, _ in same),
        "same_seed_ends_apart_m": max(apart_m, default=None),
    }
    apart = f"at most {1e3 * max(apart_m):.2f} mm apart" if apart_m else "nowhere"
    lines = [
        "# The whole hot-stab, live",
        "",
        _TEXT,
        "",
        job_table([("over `geo`", first)]),
    ]
    if same:
        lines += [
            "",
            f"{len(same)} seeds done twice: {sum(alike for alike, _ in same)} with the same verdict and the same model to "
            f"the bit, their plugs {apart} in the end.",
        ]
    return summary, "\n".join(lines + footnotes(result))


def _alike(one: Case, other: Case) -> tuple[bool, float | None]:
    """Compare two jobs of one seed: same outcome, and distance between their plugs' ends [m]."""
    if not (one["success"] and other["success"]):
        return one["success"] == other["success"], None
    a, b = one["execution"], other["execution"]
    apart_m = float(np.hypot(a["depth_m"] - b["depth_m"], a["lateral_m"] - b["lateral_m"]))
    return one["model_sha256"] == other["model_sha256"], apart_m


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()
