"""Extraction of the plug, held before the receptacle at the end, by the arm with real contact.

Five demonstrations of the scripted operator on its own arm, whose plug is in the bore at first; lambda = 0.10 m. The
robot's receptacle is anywhere in the box of `hot-stab`, the trackers are those of `hot-stab`.

- *clean*, *typical*: the plug is in the bore, 0.5 to 2 mm from its bottom, within the clearance, and is not pressed
- *after its own hot-stab*: the robot has inserted the plug itself, and presses it in until it begins; typical tracker
- *sway*: the same while the receptacle swings along a line by 20 mm at 0.1 Hz
- *bias*: 5 mm / 4 degrees, else as typical
- *without touch*: the arm neither gives way sideways nor takes the plug for a sign of where the bore is

Success: the tip within 15 mm of the point on the axis 120 mm before the mouth, at rest (slower than 15 mm/s in the mean
over half a second; the tracker's noise alone moves it about with 10 mm/s), less than 5 N on the plug, all this for
1 s, and the receptacle never dragged by more than 5 mm. In sway, where that noise tells more, 30 mm and 80 mm/s.
Forces are means over 10 ms of the wrist's sensor, tared; wanted are peaks of at most 50 N in the median and 100 N
at 95 %.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from farhand.common.arm.simulation.disturbances import DisturbanceSettings, Sway
from farhand.common.arm.simulation.simulation import TICK_S
from farhand.common.arm.simulation.starts_and_goals import (
    MAX_DRAGGED_M,
    STANDOFF_M,
    Box,
    Placement,
    Withdrawn,
)
from farhand.common.model.tphsmm import TPHSMM
from farhand.deploy.places import sample_files
from farhand.evaluation.arm import hot_stab
from farhand.evaluation.arm.arm_figures import draw_motions
from farhand.evaluation.arm.arm_record import TrialRecord, outcome_cells, outcome_of
from farhand.evaluation.arm.arm_trial import STIFF, Conditions, Trial, arm_cell
from farhand.evaluation.arm.hot_stab import LAMBDA_M
from farhand.evaluation.metrics.motion_metrics import dtw_rms, time_rms
from farhand.evaluation.metrics.tables import table, write_figure
from farhand.evaluation.study import Case, by_value, reporting_seeds
from farhand.local_site.learning.online_learner import LearnerSettings
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import learn
from farhand.local_site.workcell.operator_arm import demonstrations
from farhand.remote_site.perception.simulated_sight import TYPICAL

Array = NDArray[np.float64]

HEADER = (
    "",
    "success",
    "required",
    "peak force, median / 95 % / most [N]",
    "receptacle dragged, median / most [mm]",
    "from the stand-off, median / 95 % [mm]",
    "out of the mouth after [s]",
    "at the stand-off after [s]",
)


def summary_of(part: list[Case], required: float) -> Case:
    """Summarise the trials of one scenario, with the required rate of success."""
    dragged, away, out, reached = (
        np.array([r[key] for r in part]) for key in ("dragged_m", "away_m", "out_s", "reached_s")
    )
    return {
        **outcome_of(part, required),
        "dragged_median_m": float(np.median(dragged)),
        "dragged_max_m": float(dragged.max()),
        "away_median_m": float(np.median(away)),
        "away_p95_m": float(np.quantile(away, 0.95)),
        "out_median_s": _median_of_known(out),
        "reached_median_s": _median_of_known(reached),
    }


def _median_of_known(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else math.nan


def row_of(name: str, part: list[Case], summary: Case) -> tuple[str, ...]:
    """Return the row under `HEADER`."""
    return (
        *outcome_cells(name, part, summary),
        f"{summary['peak_median_n']:.0f} / {summary['peak_p95_n']:.0f} / {summary['peak_max_n']:.0f}",
        f"{summary['dragged_median_m'] * 1e3:.1f} / {summary['dragged_max_m'] * 1e3:.1f}",
        f"{summary['away_median_m'] * 1e3:.1f} / {summary['away_p95_m'] * 1e3:.1f}",
        f"{summary['out_median_s']:.1f}",
        f"{summary['reached_median_s']:.1f}",
    )


_SWAYING = Conditions(noise=TYPICAL, disturbances=DisturbanceSettings(receptacle=Sway(0.020, 0.1)))
_BIASED = replace(TYPICAL, bias_m=0.005, bias_rad=math.radians(4.0))


class Scenario(NamedTuple):
    """Conditions of a group of trials.

    Args:
        conditions: Disturbances and noise.
        required: Required rate of success; zero for none.
        share: Number of its trials per typical one.
        inserts: Whether the robot inserts the plug itself before.
        goal: Required distance and stillness at the end.
    """

    conditions: Conditions
    required: float = 0.0
    share: float = 0.25
    inserts: bool = False
    goal: Callable[[], Withdrawn] = Withdrawn


SCENARIOS = {
    "clean": Scenario(Conditions(), 1.0),
    "typical": Scenario(Conditions(noise=TYPICAL), 0.98, 1.0),
    "after its own hot-stab": Scenario(Conditions(noise=TYPICAL), 0.98, 0.5, inserts=True),
    "sway": Scenario(_SWAYING, inserts=True, goal=partial(Withdrawn, 0.030, 0.080)),
    "bias": Scenario(Conditions(noise=_BIASED)),
    "bias, without touch": Scenario(Conditions(noise=_BIASED, correcting=False, compliance=STIFF)),
}

_TRIALS = 100


TAKES_ROBOT = True


@cache
def shown(own_arm: str = "") -> list[Demonstration]:
    """Return the demonstrations that come with the task, or those of the scripted operator on another arm."""
    files = sample_files("hot-stab-removal")
    if own_arm:
        return list(demonstrations("hot-stab-removal", len(files), 0, arm_cell(own_arm)))
    return [Demonstration.load(file) for file in files]


@cache
def taught(own_arm: str = "") -> TPHSMM:
    """Return the model learned from them."""
    return learn(shown(own_arm), LearnerSettings(LAMBDA_M))


def cases(trials: int | None, seed: int) -> list[Case]:
    """List every scenario with the same seeds, and the demonstrations' own starts."""
    n = trials or _TRIALS
    seeds = reporting_seeds(seed, n)
    like = [{"seed": seeds[0], "scenario": "like", "like": k} for k in range(len(shown()))]
    return like[: max(1, n)] + [
        {"seed": s, "scenario": name}
        for name, scenario in SCENARIOS.items()
        for s in seeds[: math.ceil(scenario.share * n)]
    ]


def trial(case: Case) -> Case:
    """Run one execution."""
    record, goal, began_s = _run(case)
    local = np.stack(record.local)[:, :3]
    row = {
        **case,
        "success": record.success,
        "cause": "the receptacle was dragged" if goal.dragged_m > MAX_DRAGGED_M else record.cause,
        "peak_n": record.peak_n,
        "dragged_m": goal.dragged_m,
        "away_m": float(np.linalg.norm(local[-1] + (0.0, 0.0, STANDOFF_M))),
        "out_s": goal.out_s - began_s,
        "reached_s": record.inserted_s,
    }
    own_arm = case.get("own_arm", "")
    if case["scenario"] == "like" and row["success"] and _alike(case):
        like = shown(own_arm)[case["like"]]
        time_s = TICK_S * np.arange(len(local), dtype=np.float64)
        row["dtw_rms_m"] = dtw_rms(local, like.in_frame())
        row["time_rms_m"] = time_rms(time_s, local, like.time_s, like.in_frame())
    return row


def _run(case: Case) -> tuple[TrialRecord, Withdrawn, float]:
    """Return the record, the goal, and the time of the beginning [s]."""
    seed, like = case["seed"], case["scenario"] == "like"
    scenario = SCENARIOS["clean" if like else case["scenario"]]
    goal, arm, own_arm = scenario.goal(), case.get("arm", ""), case.get("own_arm", "")
    if scenario.inserts:
        ready = Trial(hot_stab.taught(own_arm), scenario.conditions, seed, arm=arm)
        inserted = ready.run()
        if inserted.cause:
            inserted.cause = f"not inserted: {inserted.kind_of_failure}"
            return inserted, goal, ready.began_s
        ready.go_on(taught(own_arm), goal)
        return ready.run(), goal, ready.began_s
    random = np.random.default_rng(case["like"] if like else [seed, 1])
    cell = arm_cell(arm)
    placement = Placement.seated(random, Box.of(cell.robot), cell)
    trial = Trial(taught(own_arm), scenario.conditions, seed, placement, goal=goal, arm=arm)
    return trial.run(), goal, trial.began_s


def _alike(case: Case) -> bool:
    """Decide whether the robot is the arm on which it was taught."""
    return case.get("arm", "") == case.get("own_arm", "")


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make one row for each scenario, and the error to the demonstrations."""
    summary: Case = {}
    rows = []
    for name, part in by_value(results, "scenario", SCENARIOS).items():
        summary[name] = summary_of(part, SCENARIOS[name].required)
        rows.append(row_of(name, part, summary[name]))
    like = [r for r in results if "dtw_rms_m" in r]
    for key in ("dtw_rms_m", "time_rms_m"):
        summary[key] = float(np.mean([r[key] for r in like])) if like else None
    summary["n_components"] = int((~taught(results[0].get("own_arm", "")).terminal).sum())
    if "typical" in summary:
        summary |= {key: summary["typical"][key] for key in ("success_rate", "success_interval")}
    causes = [f"- {name}: {summary[name]['causes'] or 'none'}" for name in SCENARIOS if name in summary]
    parts = [
        "# Hot-stab removal",
        "",
        _TEXT,
        "",
        table(HEADER, rows),
        "",
        _likeness(summary, _alike(results[0])),
        "",
    ]
    return summary, "\n".join([*parts, "Causes of failure:", *causes])


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()


def _likeness(summary: Case, alike: bool) -> str:
    if not alike:
        return "The demonstrations were made on another arm: executions are not compared with them."
    if summary["dtw_rms_m"] is None:
        return "No execution from a demonstration's own beginning was a success."
    return (
        f"Components: {summary['n_components']}. From the demonstrations' own beginnings, clean, with contact: "
        f"{100 * summary['dtw_rms_m']:.2f} cm to them along dynamic time warping, "
        f"{100 * summary['time_rms_m']:.2f} cm at equal fractions of the time."
    )


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw the pictures of `hot-stab`: demonstrations in both frames, model, executions."""
    part = [r for r in results if r["scenario"] == "typical"][:12]
    runs = [(np.stack(_run(case)[0].local), case["success"]) for case in part]
    own_arm = results[0].get("own_arm", "")
    figure: Figure = draw_motions(shown(own_arm), taught(own_arm), runs)
    write_figure(figure, out_dir / "hot-stab-removal.png")
    return ["hot-stab-removal.png"]
