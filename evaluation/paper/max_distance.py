"""Effect of lambda: components, closeness to the demonstrations and success, with and without the ramp.

Five demonstrations of the synthetic approach; each is reproduced from its own start (both root mean
square errors: at equal fractions of the time, and along dynamic time warping), and a new start and
receptacle test the approach.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from farhand.evaluation.metrics.motion_metrics import approach_of, dtw_rms, time_rms
from farhand.evaluation.metrics.tables import rate, spread, table, write_figure
from farhand.evaluation.paper.approach_trials import hands, scene, stepping, taught
from farhand.evaluation.paper.closed_loop import Disturbance, execute
from farhand.evaluation.study import Case, reporting_seeds

_LAMBDAS_M = (0.02, 0.03, 0.05, 0.10, 0.15, 0.20)
_TRIALS = 20  # trials of each lambda and reference


def cases(trials: int | None, seed: int) -> list[Case]:
    """List every lambda and reference with the same seeds."""
    seeds = reporting_seeds(seed, trials or _TRIALS)
    return [{"seed": s, "lambda_m": m, "ramp": r} for m, r, s in product(_LAMBDAS_M, (True, False), seeds)]


def trial(case: Case) -> Case:
    """Reproduce a demonstration, then execute elsewhere."""
    _, model = taught(case["seed"], lambda_m=case["lambda_m"])
    used = model if case["ramp"] else stepping(model)
    hand = hands(case["seed"])
    like = hand[case["seed"] % len(hand)]
    again = execute(used, like.position_m[0], Disturbance(like.frames_at(0)[0]))
    event, _, start = scene(case["seed"], "static")
    executed = execute(used, start, event, rest_s=1.0)
    return {
        **case,
        "n_components": int((~model.terminal).sum()),
        "time_rms_m": time_rms(again.time_s, again.local, like.time_s, like.in_frame()),
        "dtw_rms_m": dtw_rms(again.local, like.in_frame()),
        "duration_ratio": float(again.time_s[-1] / np.ptp(like.time_s)),
        "success": executed.arrived and approach_of(executed.local).success,
    }


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make one row for each lambda and reference."""
    summary: Case = {}
    rows = []
    for lambda_m, ramp in product(_LAMBDAS_M, (True, False)):
        part = [r for r in results if (r["lambda_m"], r["ramp"]) == (lambda_m, ramp)]
        column = {key: [r[key] for r in part] for key in part[0]}
        name = "ramp" if ramp else "step"
        summary[f"{lambda_m:g} m, {name}"] = {
            key: float(np.mean(column[key]))
            for key in ("n_components", "time_rms_m", "dtw_rms_m", "duration_ratio", "success")
        }
        rows.append(
            (
                f"{lambda_m:g}",
                name,
                f"{np.mean(column['n_components']):.1f}",
                spread(column["time_rms_m"], 100),
                spread(column["dtw_rms_m"], 100),
                spread(column["duration_ratio"]),
                rate(column["success"]),
            )
        )
    header = ("lambda [m]", "reference", "components", "RMSE, time [cm]", "RMSE, DTW [cm]", "duration ratio", "success at new starts")  # fmt: skip
    text = "The paper has 15 components at lambda = 0.10 m. The step from mean to mean is the paper's reference, the ramp our default."
    return summary, "\n".join(["# Lambda", "", _TEXT, "", table(header, rows), "", text])


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw components and errors against lambda."""
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)

    def mean(key: str, lambda_m: float, ramp: bool) -> float:
        return float(np.mean([r[key] for r in results if (r["lambda_m"], r["ramp"]) == (lambda_m, ramp)]))

    left.loglog(_LAMBDAS_M, [mean("n_components", m, True) for m in _LAMBDAS_M], "o-", label="ours")
    left.plot(0.10, 15, "k*", markersize=12, label="paper")
    left.set(xlabel="lambda [m]", ylabel="components")
    left.set_xticks(_LAMBDAS_M, [f"{m:g}" for m in _LAMBDAS_M])
    left.set_yticks([5, 10, 20, 50, 100], ["5", "10", "20", "50", "100"])
    left.minorticks_off()
    for ramp, style in ((True, "o-"), (False, "s--")):
        for key, colour, name in (("time_rms_m", "tab:blue", "time"), ("dtw_rms_m", "tab:orange", "DTW")):
            label = f"{name}, {'ramp' if ramp else 'step'}"
            right.plot(
                _LAMBDAS_M, [100 * mean(key, m, ramp) for m in _LAMBDAS_M], style, color=colour, label=label
            )
    right.set(xlabel="lambda [m]", ylabel="RMSE to the demonstration [cm]", ylim=(0, None))
    for axes in (left, right):
        axes.legend(fontsize=8)
        axes.grid(alpha=0.3, which="both")
    write_figure(figure, out_dir / "lambda.png")
    return ["lambda.png"]
