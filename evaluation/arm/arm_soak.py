"""A thousand insertions by the arm in one process: memory stays flat, and MuJoCo gives no warning.

The trials take the scenarios of `robustness` in turn. After every control period the physics checks MuJoCo's
counters of warnings; one that is not zero ends the trial, and is counted here. Memory is the process's
resident set after each trial.
"""

from __future__ import annotations

import gc
import os
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from farhand.evaluation.arm.arm_trial import Trial
from farhand.evaluation.arm.hot_stab import taught
from farhand.evaluation.arm.robustness import SCENARIOS, conditions_of
from farhand.evaluation.metrics.tables import rate, table, write_figure
from farhand.evaluation.study import Case, reporting_seeds

_TRIALS = 1000
_SETTLED = 0.1
"""Number of trials before memory is compared."""
_MIB = 2.0**20


def cases(trials: int | None, seed: int) -> list[Case]:
    """Return one case with all trials, which share a process."""
    return [{"seeds": list(reporting_seeds(seed, trials or _TRIALS))}]


def trial(case: Case) -> Case:
    """Run insertions in a row."""
    names, rows = list(SCENARIOS), []
    for number, seed in enumerate(case["seeds"]):
        scenario = {"scenario": names[number % len(names)], "seed": seed}
        row = Trial(taught(), conditions_of(scenario), seed).run().row()
        gc.collect()  # memory that is still held is in use
        rows.append({**scenario, **row, "resident_mib": _resident_mib()})
    return {"rows": rows}


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Report memory, warnings, successes and time."""
    (result,) = results
    rows = result["rows"]
    memory = np.array([row["resident_mib"] for row in rows])
    settled = memory[int(_SETTLED * len(memory)) :]
    summary = {
        "trials": len(rows),
        "success_rate": float(np.mean([row["success"] for row in rows])),
        "warnings": sum(row["cause"].startswith("MuJoCo") for row in rows),
        "resident_mib": float(memory[-1]),
        "grown_mib": float(settled[-1] - settled[0]),
        "tick_ms": float(np.mean([row["tick_ms"] for row in rows])),
    }
    header = (
        "in a row",
        "successes",
        "warnings of MuJoCo",
        "memory [MiB]",
        "grown since the first tenth [MiB]",
    )
    numbers = (f"{summary['resident_mib']:.0f}", f"{summary['grown_mib']:.1f}")
    line = (len(rows), rate([row["success"] for row in rows]), str(summary["warnings"]), *numbers)
    return summary, "\n".join(["# The arm, for long", "", _TEXT, "", table(header, [line])])


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw the memory over the trials."""
    figure = Figure(figsize=(7.0, 3.0), layout="constrained")
    axes = figure.subplots()
    axes.plot([row["resident_mib"] for row in results[0]["rows"]])
    axes.set(xlabel="trial", ylabel="memory [MiB]", ylim=(0.0, None))
    write_figure(figure, out_dir / "arm-soak.png")
    return ["arm-soak.png"]


def _resident_mib() -> float:
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / _MIB
