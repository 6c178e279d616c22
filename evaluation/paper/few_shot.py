"""Number of demonstrations needed: success and closeness from 1 to 12 of them.

The synthetic approach task, lambda = 0.10 m, new starts and receptacles. Ours beside a ProMP with the paper's
setting in the receptacle's frame and the warped mean demonstration.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from farhand.evaluation.metrics.baselines import PAPER, PrompBaseline, mean_warp
from farhand.evaluation.metrics.motion_metrics import approach_of, at_phases, dtw_rms
from farhand.evaluation.metrics.tables import rate, spread, table, wilson_interval, write_figure
from farhand.evaluation.paper.approach_task import TAUGHT_STARTS, demonstrate, random_frame
from farhand.evaluation.paper.approach_trials import taught
from farhand.evaluation.paper.closed_loop import Disturbance, execute
from farhand.evaluation.study import Case, reporting_seeds

_NUMBERS = (1, 2, 3, 5, 8, 12)
_TRIALS = 60  # trials of each number
METHODS = ("ours", "ProMP", "mean warp")


def cases(trials: int | None, seed: int) -> list[Case]:
    """List every number of demonstrations with the same seeds."""
    return [{"seed": s, "n": n} for n in _NUMBERS for s in reporting_seeds(seed, trials or _TRIALS)]


def trial(case: Case) -> Case:
    """Run all methods from one new start."""
    shown, model = taught(case["seed"], case["n"])
    random = np.random.default_rng([case["seed"], 1])
    like = demonstrate(random, TAUGHT_STARTS.sample(random), random_frame(random))
    frame, begin, mouth = like.frames_at(0)[0], like.in_frame()[0], np.zeros(3)
    times, local = [d.time_s for d in shown], [d.in_frame() for d in shown]
    found = {
        "ours": execute(model, like.position_m[0], Disturbance(frame)).local,
        "ProMP": PrompBaseline.fit(times, local, PAPER).motion((0.0, begin), (1.0, mouth), n_points=200),
        "mean warp": mean_warp([at_phases(t, p) for t, p in zip(times, local, strict=True)], begin, mouth),
    }
    measured = {
        name: {"success": approach_of(path).success, "dtw_rms_m": dtw_rms(path, like.in_frame())}
        for name, path in found.items()
    }
    return {**case, "n_components": int((~model.terminal).sum()), **measured}


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make one row for each number of demonstrations."""
    summary: Case = {}
    rows = []
    for n in _NUMBERS:
        part = [r for r in results if r["n"] == n]
        row = [str(n), f"{np.mean([r['n_components'] for r in part]):.1f}"]
        for name in METHODS:
            success, errors = [r[name]["success"] for r in part], [r[name]["dtw_rms_m"] for r in part]
            row += [rate(success), spread(errors, 100)]
            summary[f"{n}, {name}"] = {
                "success_rate": float(np.mean(success)),
                "success_interval": wilson_interval(sum(success), len(success)),
                "dtw_rms_m": float(np.mean(errors)),
            }
        rows.append(row)
    header = ["demonstrations", "components"] + [
        f"{m}: {x}" for m in METHODS for x in ("success", "DTW [cm]")
    ]
    return summary, "\n".join(["# Few demonstrations", "", _TEXT, "", table(header, rows)])


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw success and error against the number of demonstrations."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for name, colour in zip(METHODS, ("tab:blue", "tab:purple", "tab:green"), strict=True):
        for axes, key, scale in ((left, "success", 100.0), (right, "dtw_rms_m", 100.0)):
            means = [scale * float(np.mean([r[name][key] for r in results if r["n"] == n])) for n in _NUMBERS]
            axes.plot(_NUMBERS, means, "o-", color=colour, label=name)
    left.set(xlabel="demonstrations", ylabel="success [%]", ylim=(0, 103))
    right.set(xlabel="demonstrations", ylabel="RMSE, DTW, to the hand [cm]", ylim=(0, None))
    right.legend(fontsize=8)
    write_figure(figure, out_dir / "few-shot.png")
    return ["few-shot.png"]
