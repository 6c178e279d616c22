"""Robustness of the arm's hot-stab: sway, jumps, current, a target out of sight, errors of the tracker.

The task, the box and the success are those of `hot-stab`; where nothing else is said, the tracker is the typical
one. A trial ends after 30 s, that of a jump after 18 s. In each scenario every failed trial is repeated with the
same seed and an exact tracker: a trial that then succeeds failed because of its perception. The kinematic
pre-flight check gives its verdict, but the trial runs anyway: the last column has the successes among the trials
that the check accepts.

- *sway*: the receptacle swings along a line
- *jump*: it moves by 10 cm within 0.5 s, when the tip is between 35 and 135 mm in front of the mouth
- *lost*: it is out of sight from 40 mm before the mouth on
- *bias*: standard deviations of the tracker's constant error, per axis

Bias again, in a grid, as three robots see it: one that neither gives way sideways nor corrects the frame, one that
gives way, and one that does both.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from farhand.common.arm.simulation.disturbances import PRESETS, DisturbanceSettings, Sway
from farhand.evaluation.arm.arm_figures import SuccessRate, draw_rates
from farhand.evaluation.arm.arm_record import HEADER, TrialRecord, row_of, summary_of
from farhand.evaluation.arm.arm_trial import STIFF, Conditions, Trial
from farhand.evaluation.arm.hot_stab import taught
from farhand.evaluation.metrics.tables import rate, table, wilson_interval, write_figure
from farhand.evaluation.study import Case, reporting_seeds
from farhand.remote_site.perception.simulated_sight import CLEAN, TYPICAL

_TRIALS = 100  # trials of each scenario; half as many of each bias, a fifth of each point of the grid
_JUMP_M = (0.035, 0.135)
_LIMIT_S, _JUMP_LIMIT_S = 30.0, 18.0
"""Time after which a trial has failed; it leaves room for a new approach or a retry [s]."""


def _moving(**what: object) -> Conditions:
    return Conditions(noise=TYPICAL, disturbances=DisturbanceSettings(**what))  # pyright: ignore[reportArgumentType]


def _biased(bias_mm: float, bias_deg: float) -> Conditions:
    return Conditions(noise=replace(TYPICAL, bias_m=1e-3 * bias_mm, bias_rad=math.radians(bias_deg)))


SCENARIOS: dict[str, tuple[Conditions, float]] = {
    "sway 20 mm, 0.1 Hz": (_moving(receptacle=Sway(0.020, 0.1)), 0.97),
    "sway 50 mm, 0.2 Hz": (_moving(receptacle=Sway(0.050, 0.2)), 0.90),
    "jump 10 cm": (replace(_moving(step_m=0.10, step_for_s=0.5), jump_within_m=_JUMP_M[0]), 0.95),
    "current 0.5 m/s": (_moving(current_m_s=0.5), 0.97),
    "lost for 2 s": (Conditions(noise=TYPICAL, lost_s=2.0), 0.97),
    "lost for 4 s": (Conditions(noise=TYPICAL, lost_s=4.0), 0.97),
    "typical disturbances": (Conditions(TYPICAL, PRESETS["typical"]), 0.0),
    "rough disturbances": (Conditions(TYPICAL, PRESETS["rough"]), 0.0),
    "wide box": (Conditions(TYPICAL, wide=True), 0.0),
}
BIASES: dict[str, tuple[Conditions, float]] = {
    f"bias {mm} mm, {degrees} deg": (_biased(mm, degrees), required)
    for mm, degrees, required in ((5, 2, 0.9), (5, 3, 0.9), (5, 4, 0.9), (10, 2, 0.9), (15, 2, 0.8))
} | {
    f"bias {mm} mm, {degrees} deg, no retry": (replace(_biased(mm, degrees), attempts=0), 0.0)
    for mm, degrees in ((5, 4), (15, 2))
}
ROBOTS = {
    "stiff": {"compliance": STIFF, "correcting": False, "attempts": 0},
    "gives way": {"correcting": False, "attempts": 0},
    "gives way, corrects, retries": {},
}
GRID_MM, GRID_DEG = (0, 5, 10, 15), (0, 2, 5)


TAKES_ROBOT = True


def cases(trials: int | None, seed: int) -> list[Case]:
    """List every scenario and every point of the grid with the same seeds.

    `--only required` leaves the rows that have a required rate.
    """
    n = trials or _TRIALS
    seeds = reporting_seeds(seed, n)
    out: list[Case] = []
    for rows, part in ((SCENARIOS, seeds), (BIASES, seeds[: math.ceil(n / 2)])):
        for name, (_, required) in rows.items():
            kind = "required" if required else "further"
            out += [{"seed": s, "scenario": name, "kind": kind} for s in part]
    few = seeds[: math.ceil(n / 5)]
    grid = [(robot, mm, degrees) for robot in ROBOTS for mm in GRID_MM for degrees in GRID_DEG]
    return out + [
        {"seed": s, "scenario": "grid", "kind": "grid", "robot": robot, "bias_mm": mm, "bias_deg": degrees}
        for robot, mm, degrees in grid
        for s in few
    ]


def trial(case: Case) -> Case:
    """Run one execution, and repeat it with an exact tracker if it failed."""
    conditions = conditions_of(case)
    row = {**case, **_run(conditions, case).row()}
    if case["scenario"] != "grid" and not row["success"]:
        row["exact_success"] = _run(replace(conditions, noise=CLEAN), case).success
    return row


def _run(conditions: Conditions, case: Case) -> TrialRecord:
    limit_s = _LIMIT_S if conditions.jump_within_m is None else _JUMP_LIMIT_S
    model, arm = taught(case.get("own_arm", "")), case.get("arm", "")
    return Trial(model, conditions, case["seed"], limit_s=limit_s, arm=arm).run()


def conditions_of(case: Case) -> Conditions:
    """Return the conditions of a case."""
    if case["scenario"] == "grid":
        return replace(_biased(case["bias_mm"], case["bias_deg"]), **ROBOTS[case["robot"]])
    conditions, _ = (SCENARIOS | BIASES)[case["scenario"]]
    if conditions.jump_within_m is None:
        return conditions
    return replace(conditions, jump_within_m=np.random.default_rng([case["seed"], 3]).uniform(*_JUMP_M))


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make a row for each scenario, attribute the failures, and tabulate the grid."""
    summary: Case = {}
    rows = []
    for name, (_, required) in (SCENARIOS | BIASES).items():
        part = [r for r in results if r["scenario"] == name]
        if not part:
            continue
        failed = [r for r in part if not r["success"]]
        summary[name] = summary_of(part, required)
        let_through = [r["success"] for r in part if not r["refusal"]]
        summary[name]["refused"] = len(part) - len(let_through)
        summary[name]["success_if_let_through"] = float(np.mean(let_through)) if let_through else None
        summary[name]["failed_for_want_of_perception"] = sum(r["exact_success"] for r in failed)
        why = "; ".join(f"{n} {cause}" for cause, n in summary[name]["causes"].items()) or "none"
        by_sight = f"{summary[name]['failed_for_want_of_perception']} of {len(failed)}" if failed else ""
        rows.append((*row_of(name, part, summary[name])[:-1], why, by_sight, rate(let_through)))
    header = (*HEADER[:-1], "failures", "of them not with an exact tracker", "let through")
    parts = ["# Robustness", "", _TEXT, "", table(header, rows) if rows else "", "", _notes(summary)]
    if _has_grid(results):
        summary["grid"], grid = _grid(results)
        parts += ["", grid]
    return summary, "\n".join(parts)


def _has_grid(results: list[Case]) -> bool:
    return any(result["scenario"] == "grid" for result in results)


def _grid(results: list[Case]) -> tuple[list[Case], str]:
    """Return the rates of the grid, and their table."""
    rates = [
        {"robot": robot, "bias_mm": mm, "bias_deg": degrees, **_rate(results, robot, mm, degrees)}
        for robot in ROBOTS
        for mm in GRID_MM
        for degrees in GRID_DEG
    ]
    return rates, table(
        ("bias", *ROBOTS),
        [
            (
                f"{mm} mm, {degrees} deg",
                *(f"{100 * _rate(results, robot, mm, degrees)['success_rate']:.0f} %" for robot in ROBOTS),
            )
            for mm in GRID_MM
            for degrees in GRID_DEG
        ],
    )


def _notes(summary: Case) -> str:
    wide, sway = summary.get("wide box"), summary.get("sway 50 mm, 0.2 Hz")
    notes = []
    if wide is not None:
        notes.append(f"Of the wide box (12 by 30 by 25 cm) the pre-flight refuses {wide['refused']}.")
    if sway is not None:
        notes.append(f"The largest force in the sway of 50 mm was {sway['peak_max_n']:.0f} N.")
    if summary:
        most_n = max(each["peak_max_n"] for each in summary.values())
        notes.append(f"The largest force of all of the above was {most_n:.0f} N.")
    return " ".join(notes)


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()


def _rate(results: list[Case], robot: str, mm: float, degrees: float) -> Case:
    success = [
        r["success"]
        for r in results
        if r["scenario"] == "grid" and (r["robot"], r["bias_mm"], r["bias_deg"]) == (robot, mm, degrees)
    ]
    interval = wilson_interval(sum(success), len(success))
    return {"success_rate": float(np.mean(success)), "success_interval": interval}


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw the success in every scenario, and over bias for each robot; nothing of a part."""
    if any(case not in {r["kind"] for r in results} for case in ("required", "further", "grid")):
        return []
    scenarios = {}
    for name, (_, required) in (SCENARIOS | BIASES).items():
        success = [r["success"] for r in results if r["scenario"] == name]
        interval = wilson_interval(sum(success), len(success))
        scenarios[name] = SuccessRate(float(np.mean(success)), interval, required)
    grid = {
        robot: {
            degrees: [SuccessRate(*_rate(results, robot, mm, degrees).values()) for mm in GRID_MM]
            for degrees in GRID_DEG
        }
        for robot in ROBOTS
    }
    write_figure(draw_rates(scenarios, grid, GRID_MM), out_dir / "robustness.png")
    return ["robustness.png"]
