"""Reason why the controller must be at the robot: its error when it sees the task frame late.

The receptacle sways by 5 cm and 0.1 rad with a period of 6 s. The same controller executes the same model,
but is given the frame as it was some time ago, which is what it would have across a link with that delay.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from farhand.evaluation.metrics.motion_metrics import approach_of
from farhand.evaluation.metrics.tables import quantiles, rate, table, wilson_interval, write_figure
from farhand.evaluation.paper.approach_trials import scene, taught
from farhand.evaluation.paper.closed_loop import SETTINGS, execute
from farhand.evaluation.study import Case, reporting_seeds

_AGES_S = (0.0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.6, 1.0)
_TRIALS = 50  # trials of each age


def cases(trials: int | None, seed: int) -> list[Case]:
    """List every age with the same seeds."""
    return [{"seed": s, "age_s": age} for age in _AGES_S for s in reporting_seeds(seed, trials or _TRIALS)]


def trial(case: Case) -> Case:
    """Run one execution in sway."""
    _, model = taught(case["seed"])
    event, _, start = scene(case["seed"], "sway")
    late = round(case["age_s"] / SETTINGS.dt_s)
    executed = execute(
        model, start, event, seen=lambda frames: frames[max(0, len(frames) - 1 - late)], rest_s=2.0
    )
    after = executed.time_s > executed.time_s[-1] - 2.0
    return {
        **case,
        "success": executed.arrived and approach_of(executed.local).success,
        "error_m": float(np.mean(np.linalg.norm(executed.local[after], axis=1))),
    }


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Tabulate success and error for each age."""
    summary: Case = {}
    rows = []
    for age in _AGES_S:
        part = [r for r in results if r["age_s"] == age]
        success, errors = [r["success"] for r in part], [r["error_m"] for r in part]
        summary[f"{age:g} s"] = {
            "success_rate": float(np.mean(success)),
            "success_interval": wilson_interval(sum(success), len(success)),
            "median_error_m": float(np.median(errors)),
        }
        rows.append((f"{age:g}", rate(success), quantiles(errors, 1e3)))
    header = ("age of the frame [s]", "success", "error at the mouth [mm], median / 90 %")
    return summary, "\n".join(["# Age of the task frame", "", _TEXT, "", table(header, rows)])


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw the error against the age."""
    figure = Figure(figsize=(6.0, 3.8), layout="constrained")
    axes = figure.subplots()
    errors = [[1e3 * r["error_m"] for r in results if r["age_s"] == age] for age in _AGES_S]
    low, middle, high = (np.array([np.percentile(e, q) for e in errors]) for q in (10, 50, 90))
    axes.fill_between(_AGES_S, low, high, alpha=0.25, label="10 to 90 %")
    axes.plot(_AGES_S, middle, "o-", label="median")
    axes.axhline(3.0, color="tab:red", linestyle="--", label="tolerance of the hot-stab study")
    axes.axvline(0.6, color="0.5", linestyle=":", label="round trip of a geostationary link")
    axes.set(
        xlabel="age of the task frame [s]", ylabel="error at the mouth [mm]", ylim=(0, None), xlim=(0, None)
    )
    axes.legend(fontsize=8)
    write_figure(figure, out_dir / "frame-age.png")
    return ["frame-age.png"]
