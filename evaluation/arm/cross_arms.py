"""Models from one arm to every other: what was taught on each arm is executed by each.

On the operator's arm the scripted operator demonstrates `hot-stab` five times, as with `farhand samples --own-arm`; the
demonstrations are recorded through the tracker of `hot-stab`. The robot's receptacle is anywhere in its own workplace, its
tracker is typical. The pre-flight check judges each trial before it begins: what it refuses is not executed, and counts apart.
"""

from __future__ import annotations

from functools import cache

from farhand.common.model.tphsmm import TPHSMM
from farhand.deploy.places import robot_names
from farhand.evaluation.arm import hot_stab
from farhand.evaluation.arm.arm_trial import Conditions, Trial
from farhand.evaluation.metrics.tables import rate, table, wilson_interval
from farhand.evaluation.study import Case, reporting_seeds
from farhand.remote_site.perception.simulated_sight import TYPICAL

REQUIRED = 0.95
"""Required share of successes among the trials that the pre-flight check lets through."""
_TRIALS = 20
_CONDITIONS = Conditions(noise=TYPICAL, obeying=True)


def cases(trials: int | None, seed: int) -> list[Case]:
    """List all pairs of arms with the same seeds; `--only` takes a pair, as `baxter-left>baxter-right`, or an arm."""
    arms, seeds = robot_names(), reporting_seeds(seed, trials or _TRIALS)
    return [
        {"own_arm": own, "arm": arm, "pair": f"{own}>{arm}", "seed": s}
        for own in arms
        for arm in arms
        for s in seeds
    ]


def trial(case: Case) -> Case:
    """Run one execution, unless the pre-flight check refuses it."""
    record = Trial(_taught(case["own_arm"]), _CONDITIONS, case["seed"], arm=case["arm"]).run()
    return {**case, **record.row(), "let_through": not record.refusal}


@cache
def _taught(own_arm: str) -> TPHSMM:
    return hot_stab.taught(own_arm)


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make a table with a row for each arm that was taught on, and a column for each that executed."""
    owns, arms = (list(dict.fromkeys(result[key] for result in results)) for key in ("own_arm", "arm"))
    summary: Case = {}
    for pair in dict.fromkeys(result["pair"] for result in results):
        part = [result for result in results if result["pair"] == pair]
        good = [result["success"] for result in part if result["let_through"]]
        summary[pair] = {
            "trials": len(part),
            "let_through": len(good),
            "successes": sum(good),
            "success_interval": wilson_interval(sum(good), len(good)),
            "peak_max_n": max((result["peak_n"] for result in part if result["let_through"]), default=None),
            "causes": sorted({r["cause"] for r in part if r["let_through"] and not r["success"]}),
        }
    passed = [
        each["successes"] >= REQUIRED * each["let_through"]
        for each in summary.values()
        if each["let_through"]
    ]
    summary["pairs"], summary["pairs_that_pass"] = len(passed), sum(passed)
    rows = [(own, *(_cell(results, own, arm) for arm in arms)) for own in owns]
    causes = [
        f"- {pair}: {', '.join(each['causes'])}"
        for pair, each in summary.items()
        if ">" in pair and each["causes"]
    ]
    text = (
        f"Rows: the arm that was taught on; columns: the arm that executed. Successes among the trials that the pre-flight check let through; "
        f"{sum(passed)} of the {len(passed)} pairs of which it let any through have {100 * REQUIRED:g} % or more."
    )
    parts = [
        "# Across arms",
        "",
        _TEXT,
        "",
        text,
        "",
        table(("", *arms), rows),
        "",
        "Causes of failure:",
        *(causes or ["- none"]),
    ]
    return summary, "\n".join(parts)


def _cell(results: list[Case], own: str, arm: str) -> str:
    part = [result for result in results if (result["own_arm"], result["arm"]) == (own, arm)]
    successes = [result["success"] for result in part if result["let_through"]]
    return rate(successes) if successes else f"none of {len(part)} let through" if part else ""


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()
