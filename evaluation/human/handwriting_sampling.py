"""Dependence of the reproduced shape of a C on the sampling of its points: cause and cure.

The same demonstrations, sampled in many ways, are learned with a large and a small lambda, and executed
once with the branch chosen by the share of time alone, once with the start of the motion considered too.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from farhand.common.model.tphsmm import TPHSMM
from farhand.deploy.rollout import roll_out
from farhand.evaluation.metrics.motion_metrics import dtw_rms
from farhand.local_site.learning.online_learner import LearnerSettings
from farhand.local_site.recordings.importing import read_demonstrations
from farhand.local_site.recordings.options import ImportOptions
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import extent_m, learn

Case = dict[str, Any]

_SAMPLINGS = (
    [("every n-th", n) for n in (1, 2, 3, 5, 7, 10, 20)]
    + [("every 10th, from the n-th", n) for n in range(1, 10)]
    + [("n points equally far apart", n) for n in (50, 100, 200, 400, 1000)]
)
# Fraction of the extent, weight of direction, weight of travelled distance.
_ASSIGNMENTS = {
    "default rule": (0.25, 1.0, 0.5),
    "small lambda": (0.1, 0.0, 0.0),
    "small lambda, rule": (0.1, 1.0, 0.5),
}

_TEXT = """\
## Sampling

CShape is fragile where lambda is small against the distance between people's strokes. These strokes are
then learned as parallel lanes of components that touch here and there. At such a touching component the
observed transitions are a vote of two or three demonstrations, often a tie that the numbering of the
components decides. Another sampling moves a sample into the component or out of it, the vote turns, and the
execution follows the other lane to its end: the error does not drift with the sampling, it jumps between
two values.

The hidden semi-Markov chain forgets which lane it came along. The model does know: each component keeps the
mean and covariance of the starts of the demonstrations that visited it. The successor is therefore the one
with the largest share of the time in the component times the likelihood of the present start, and the jump is
gone, also at small lambda. A large lambda (the default rule) merges the lanes, so that there is little left to choose.

Error in % of the extent over {n} samplings (every n-th sample, shifted, equally far apart; the true last
sample kept in all):

| assignment | branch by | least | median | largest |
|---|---|---|---|---|
"""


def cases(path: Path) -> list[Case]:
    """List all samplings, assignments and branch rules."""
    return [
        {
            "part": "sampling",
            "file": str(path),
            "kind": kind,
            "n": n,
            "assignment": name,
            "by_start": by_start,
        }
        for (kind, n), name, by_start in product(_SAMPLINGS, _ASSIGNMENTS, (False, True))
    ]


def trial(case: Case) -> Case:
    """Learn from the sampled demonstrations, reproduce the last one as it was."""
    *taught, last = read_demonstrations(case["file"], ImportOptions(kind="lasa"))
    taught = [_sampled(d, case["kind"], case["n"]) for d in taught]
    fraction, direction, distance = _ASSIGNMENTS[case["assignment"]]
    settings = LearnerSettings(
        fraction * extent_m(taught), direction_weight=direction, distance_weight=distance
    )
    model = learn(taught, settings)
    if not case["by_start"]:
        model = _branching_by_time_alone(model)
    motion = last.in_frame()
    error = dtw_rms(roll_out(model, last).in_frame(), motion) / float(np.ptp(motion, axis=0).max())
    return {**case, "error": 100.0 * error, "n_components": model.n_components}


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Range of the errors for each assignment and choice of branch."""
    summary, lines = {}, []
    for name, by_start in product(_ASSIGNMENTS, (False, True)):
        errors = [r["error"] for r in results if (r["assignment"], r["by_start"]) == (name, by_start)]
        by = "time and start" if by_start else "time alone"
        low, middle, high = min(errors), float(np.median(errors)), max(errors)
        summary[f"{name}, {by}"] = {"least": low, "median": middle, "largest": high}
        lines.append(f"| {name} | {by} | {low:.2f} | {middle:.2f} | {high:.2f} |")
    return summary, _TEXT.format(n=len(_SAMPLINGS)) + "\n".join(lines)


def _branching_by_time_alone(model: TPHSMM) -> TPHSMM:
    """Return the same model with one start, and an uncertain one, for all components: all are equally likely."""
    start = np.broadcast_to(model.start_means[:, :1], model.start_means.shape)
    vague = np.broadcast_to(1e6 * np.eye(model.n_dims), model.start_covariances.shape)
    return replace(model, start_means=start, start_covariances=vague, ways=())


def _sampled(demonstration: Demonstration, kind: str, n: int) -> Demonstration:
    """Resample the demonstration in one of the ways; keep its first and last points."""
    if kind == "every n-th":
        return demonstration.thinned(n)
    time, position = demonstration.time_s, demonstration.position_m
    if kind == "every 10th, from the n-th":
        keep = np.unique(np.concatenate([[0], np.arange(n, time.size, 10), [time.size - 1]]))
        return replace(demonstration, time_s=time[keep], position_m=position[keep])
    steps = np.linalg.norm(np.diff(position, axis=0), axis=1)
    moving = np.concatenate([[True], steps > 0.0])  # equal points have no place of their own on the path
    travelled = np.concatenate([[0.0], np.cumsum(steps)])[moving]
    at = np.linspace(0.0, travelled[-1], n)
    points = np.stack([np.interp(at, travelled, axis) for axis in position[moving].T], axis=1)
    return replace(demonstration, time_s=np.interp(at, travelled, time[moving]), position_m=points)
