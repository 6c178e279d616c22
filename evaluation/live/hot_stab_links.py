"""Whole hot-stab job, live, over links of every delay, and over an acoustic link.

As the study `hot-stab-live`, with one-way delays of 0, 0.3, 1, 3 and 5 s, and over the profile `acoustic`.
"""

from __future__ import annotations

from typing import Any

from farhand.evaluation.live.live_jobs import footnotes, job, job_table, run_jobs

Case = dict[str, Any]

DELAYS_S = (0.0, 0.3, 1.0, 3.0, 5.0)


def cases(trials: int | None, seed: int) -> list[Case]:
    """List all jobs as one case, `trials` seeds on each link: one process starts the others."""
    jobs: list[Case] = []
    for number in range(100 * seed, 100 * seed + (trials or 1)):
        jobs += [job("hot-stab", number, "lan", delay_s) for delay_s in DELAYS_S]
        jobs += [job("hot-stab", number, "acoustic")]
    return [{"jobs": jobs}]


def trial(case: Case) -> Case:
    """Run all jobs, two at a time."""
    return run_jobs(case["jobs"])


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Count the finished jobs by link."""
    (result,) = results
    jobs = result["jobs"]
    groups = [
        (f"{delay_s:g} s one way", [each for each in jobs if each["delay_s"] == delay_s])
        for delay_s in DELAYS_S
    ]
    groups.append(("`acoustic`", [each for each in jobs if each["profile"] == "acoustic"]))
    summary = {
        "jobs": len(jobs),
        "done": sum(each["success"] for each in jobs),
        "took_s": {name: [each.get("took_s") for each in part] for name, part in groups},
    }
    text = (__doc__ or "").split("\n", 1)[1].strip()
    lines = ["# The whole hot-stab over every link", "", text, "", job_table(groups)]
    return summary, "\n".join(lines + footnotes(result))
