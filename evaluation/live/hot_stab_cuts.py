"""Whole hot-stab job, live, while the link is cut for 20 s in the middle of the insertion.

As the study `hot-stab-live`; when half of the previewed motion is done the link stalls, is reset, or swallows
everything, for 20 s. The robot goes on by itself, and the operator learns afterwards how it went.
"""

from __future__ import annotations

from typing import Any

from farhand.evaluation.live.live_jobs import footnotes, job, job_table, run_jobs

Case = dict[str, Any]

KINDS = ("stall", "reset", "blackhole")
_EACH, _CUT_S = 10, 20


def cases(trials: int | None, seed: int) -> list[Case]:
    """List all jobs as one case, `trials` of each kind: one process starts the others."""
    return [
        {
            "jobs": [
                job("hot-stab", 100 * seed + number, outage=f"{kind}:{_CUT_S}")
                for number in range(trials or _EACH)
                for kind in KINDS
            ]
        }
    ]


def trial(case: Case) -> Case:
    """Run all jobs, two at a time."""
    return run_jobs(case["jobs"])


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Count the finished jobs by kind of cut."""
    (result,) = results
    jobs = result["jobs"]
    groups = [(kind, [each for each in jobs if each["outage"].startswith(kind)]) for kind in KINDS]
    done = {kind: sum(each["success"] for each in part) for kind, part in groups}
    summary = {"jobs": len(jobs), "done": done, "done_together": sum(done.values())}
    text = (__doc__ or "").split("\n", 1)[1].strip()
    lines = ["# The whole hot-stab while the link is cut", "", text, "", job_table([*groups, ("all", jobs)])]
    return summary, "\n".join(lines + footnotes(result))
