"""In and out again and again by one arm: a redundant arm must not drift away with its elbow.

Each arm that comes with Farhand inserts its plug and takes it out, in turn, without going back to its rest posture between;
typical tracker. Compared are the joint angles after each insertion, and after each removal, with those of the first: means of two
seconds, because the robot follows the tracker's noise, which turns the wrist by some degrees.
"""

from __future__ import annotations

import numpy as np

from farhand.common.arm.simulation.starts_and_goals import Goal, Seated, Withdrawn
from farhand.deploy.places import robot_names
from farhand.evaluation.arm import hot_stab, hot_stab_removal
from farhand.evaluation.arm.arm_trial import Conditions, Trial
from farhand.evaluation.metrics.tables import table
from farhand.evaluation.study import Case, reporting_seeds
from farhand.remote_site.perception.simulated_sight import TYPICAL

MOST_RAD = 0.1
"""Largest allowed difference of a joint from the first time [rad]."""
_ROUNDS = 26
_SETTLING_S, _MEAN_S = 2.0, 2.0
"""Time until the arm stands at its end, and time over which its joints are averaged [s]."""


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one case for each arm; `trials` is the number of rounds. `--only` takes an arm."""
    (first,) = reporting_seeds(seed, 1)
    return [{"arm": arm, "seed": first, "rounds": trials or _ROUNDS} for arm in robot_names()]


def trial(case: Case) -> Case:
    """Insert and remove in turn until the rounds are over, or one of them fails."""
    insert, remove = hot_stab.taught(), hot_stab_removal.taught()
    running = Trial(insert, Conditions(noise=TYPICAL), case["seed"], arm=case["arm"])
    ends: dict[str, list[list[float]]] = {"in": [], "out": []}
    for number in range(2 * case["rounds"]):
        way, goal = ("out", Withdrawn()) if number % 2 else ("in", Seated())
        if number:
            next_goal: Goal = goal
            running.go_on(remove if number % 2 else insert, next_goal)
        record = running.run()
        if not record.success:
            return {**case, "done": number, "cause": record.kind_of_failure, **_drifts(ends)}
        running.mean_joints_rad(_SETTLING_S)
        ends[way].append(running.mean_joints_rad(_MEAN_S).tolist())
    return {**case, "done": 2 * case["rounds"], "cause": "", **_drifts(ends)}


def _drifts(ends: dict[str, list[list[float]]]) -> Case:
    """Return the largest difference of any joint from the first time, of each way [rad]."""
    away = {way: np.abs(np.array(rows) - rows[0]).max() if rows else 0.0 for way, rows in ends.items()}
    return {f"drift_{way}_rad": float(value) for way, value in away.items()}


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make a row for each arm."""
    summary = {
        result["arm"]: {key: value for key, value in result.items() if key != "arm"} for result in results
    }
    rows = [
        (
            result["arm"], f"{result['done']} of {2 * result['rounds']}", result["cause"] or "none",
            f"{result['drift_in_rad']:.3f}", f"{result['drift_out_rad']:.3f}",
        )
        for result in results
    ]  # fmt: skip
    header = ("arm", "done", "failure", "drift seated [rad]", "drift outside [rad]")
    return summary, "\n".join(
        ["# In and out", "", (__doc__ or "").split("\n", 1)[1].strip(), "", table(header, rows)]
    )
