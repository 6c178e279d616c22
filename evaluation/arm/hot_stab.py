"""Hot-stabbing by the arm with real contact (Sec. VI of the paper, Figs. 6 and 7).

Five demonstrations of the scripted operator on its own arm, recorded with white noise of 1 mm and half a degree per
axis, lambda = 0.10 m. The robot's arm begins near its
rest; the receptacle's mouth is anywhere in a box of 8 by 20 by 15 cm before it, tilted by up to 15 degrees.

- *clean*: the tracker is exact and without delay
- *typical*: bias 3 mm / 1 degree, jitter 5 mm / 2 degrees at 30 Hz, 30 % drop-outs, 60 ms latency

Bias and jitter are standard deviations per axis. Success: the plug's tip 75 to 95 mm deep in a bore of 85 mm and
less than 4 mm beside its axis, held for 1 s. Forces are means over 10 ms of the wrist's sensor, tared.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from farhand.common.arm.simulation.simulation import TICK_S
from farhand.common.arm.simulation.starts_and_goals import Box, Placement
from farhand.common.model.tphsmm import TPHSMM
from farhand.deploy.places import sample_files
from farhand.evaluation.arm.arm_figures import draw_motions
from farhand.evaluation.arm.arm_record import HEADER, TrialRecord, row_of, summary_of
from farhand.evaluation.arm.arm_trial import Conditions, Trial, arm_cell
from farhand.evaluation.metrics.motion_metrics import dtw_rms, time_rms
from farhand.evaluation.metrics.sensor import TRACKER, Sensor
from farhand.evaluation.metrics.tables import table, write_figure
from farhand.evaluation.study import Case, by_value, reporting_seeds
from farhand.local_site.learning.online_learner import LearnerSettings
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import learn
from farhand.local_site.workcell.operator_arm import demonstrations
from farhand.remote_site.perception.simulated_sight import PRESETS

LAMBDA_M = 0.10  # the paper's
CONDITIONS = {name: Conditions(noise=noise) for name, noise in PRESETS.items()}
REQUIRED = {"clean": 1.0, "typical": 0.98}

_TRIALS, _CLEAN = 200, 4  # trials with typical noise, and the number of these per clean one


TAKES_ROBOT = True


@cache
def shown(own_arm: str = "") -> list[Demonstration]:
    """Return the demonstrations that come with the task, or those of the scripted operator on another arm."""
    files = sample_files("hot-stab")
    if own_arm:
        return list(demonstrations("hot-stab", len(files), 0, arm_cell(own_arm)))
    return [Demonstration.load(file) for file in files]


@cache
def taught(own_arm: str = "") -> TPHSMM:
    """Return the model learned from them as seen through a tracker."""
    return learn(recorded(TRACKER, own_arm), LearnerSettings(LAMBDA_M))


def recorded(sensor: Sensor, own_arm: str = "") -> list[Demonstration]:
    """Return the demonstrations as a sensor records them."""
    hands = shown(own_arm)
    noises = np.random.default_rng(0).spawn(len(hands))
    return [sensor.record(hand, noise) for hand, noise in zip(hands, noises, strict=True)]


def cases(trials: int | None, seed: int) -> list[Case]:
    """List both noises, and the demonstrations' own starts."""
    n = trials or _TRIALS
    typical = [{"seed": s, "scenario": "typical"} for s in reporting_seeds(seed, n)]
    clean = [{**case, "scenario": "clean"} for case in typical[: max(1, n // _CLEAN)]]
    like = [{**typical[0], "scenario": "like", "like": k} for k in range(len(shown()))]
    return [*like[: max(1, n)], *clean, *typical]


def trial(case: Case) -> Case:
    """Run one execution."""
    record = _run(case)
    row = {**case, **record.row()}
    if case["scenario"] == "like" and record.success and _alike(case):
        demonstration = shown(_taught_on(case))[case["like"]]
        local, time_s = np.stack(record.local)[:, :3], TICK_S * np.arange(len(record.local), dtype=np.float64)
        inside = time_s <= record.inserted_s + 0.5  # the demonstration ends there, too
        row["dtw_rms_m"] = dtw_rms(local[inside], demonstration.in_frame())
        row["time_rms_m"] = time_rms(
            time_s[inside], local[inside], demonstration.time_s, demonstration.in_frame()
        )
        row["duration_ratio"] = float(record.inserted_s / _inserted_s(demonstration))
    return row


def _run(case: Case) -> TrialRecord:
    arm, model = case.get("arm", ""), taught(_taught_on(case))
    if case["scenario"] != "like":
        return Trial(model, CONDITIONS[case["scenario"]], case["seed"], arm=arm).run()
    random, cell = np.random.default_rng(case["like"]), arm_cell(arm)  # the sample's own seed
    placement = Placement.sample(random, Box.of(cell.robot), cell)
    return Trial(model, CONDITIONS["clean"], case["seed"], placement, arm=arm).run()


def _taught_on(case: Case) -> str:
    return case.get("own_arm", "")


def _alike(case: Case) -> bool:
    """Decide whether the robot begins where the operator's arm began: only the same arm does."""
    return case.get("arm", "") == _taught_on(case)


def _inserted_s(demonstration: Demonstration) -> float:
    """Return when the plug was in for the first time [s]."""
    return float(demonstration.time_s[np.argmax(demonstration.in_frame()[:, 2] >= 0.075)])


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make one row for each noise, and the error to the demonstrations."""
    summary: Case = {}
    rows = []
    for name, part in by_value(results, "scenario", REQUIRED).items():
        summary[name] = summary_of(part, REQUIRED[name])
        rows.append(row_of(name, part, summary[name]))
    like = [r for r in results if "dtw_rms_m" in r]
    for key in ("dtw_rms_m", "time_rms_m", "duration_ratio"):
        summary[key] = float(np.mean([r[key] for r in like])) if like else None
    summary["n_components"] = int((~taught(_taught_on(results[0])).terminal).sum())
    if "typical" in summary:
        summary |= {key: summary["typical"][key] for key in ("success_rate", "success_interval")}
    text = " ".join(
        [
            _likeness(summary, _alike(results[0])),
            *([_tracking(summary["clean"])] if "clean" in summary else []),
        ]
    )
    causes = [f"- {name}: {summary[name]['causes'] or 'none'}" for name in REQUIRED if name in summary]
    parts = ["# Hot-stab", "", _TEXT, "", table(HEADER, rows), "", text, "", "Causes of failure:", *causes]
    return summary, "\n".join(parts)


def _likeness(summary: Case, alike: bool) -> str:
    if not alike:
        return "The demonstrations were made on another arm: executions are not compared with them."
    if summary["dtw_rms_m"] is None:
        return "No execution from a demonstration's own beginning was a success."
    return (
        f"Components: {summary['n_components']} (paper: 15). From the demonstrations' own beginnings, clean, with "
        f"contact: {100 * summary['dtw_rms_m']:.2f} cm to them along dynamic time warping, "
        f"{100 * summary['time_rms_m']:.2f} cm at equal fractions of the time (paper: 1.2 ± 0.2 cm, alignment not "
        f"stated), {summary['duration_ratio']:.2f} times their duration."
    )


def _tracking(clean: Case) -> str:
    return (
        f"In free water, clean, the tip is {1e3 * clean['free_rms_median_m']:.2f} mm and "
        f"{math.degrees(clean['free_rms_median_rad']):.2f} degrees rms from its setpoint (median of the trials; 95 %: "
        f"{1e3 * clean['free_rms_p95_m']:.1f} mm, where a wrist is nearly straight or a joint at its speed limit)."
    )


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw Fig. 6 (demonstrations in the world and in the receptacle's frame, the model) and Fig. 7, left."""
    part = [r for r in results if r["scenario"] == "typical"][:12]
    runs = [(np.stack(_run(case).local), case["success"]) for case in part]
    own_arm = _taught_on(results[0])
    figure: Figure = draw_motions(shown(own_arm), taught(own_arm), runs)
    write_figure(figure, out_dir / "hot-stab.png")
    return ["hot-stab.png"]
