"""People's own demonstrations: leave one out, learn the others, reproduce it from its start.

*robotasks*: four tasks taught by hand on an arm; *letters*: three, drawn with an arm; *lasa*: thirty, handwritten.
Every fold is run, with the default rule and nothing set. Each test scene is turned and shifted at random, so
that the task frame is really used; the same scene where it was recorded must give the same motion.

The error is the root mean square distance at equal fractions of the lengths, in mm, or in % of the extent
for lasa. *ProMP* is conditioned on start and goal, with the paper's setting or the best of a grid of 18 for
each set, whichever is better there. *Mean warp* is the mean demonstration, moved linearly onto start and goal.

*Two ways*: every second demonstration is mirrored about the line from its start to its goal, as if people
did the task in two ways. A motion is human-like when it is as near to one of the people as 1.5 times the
left-out person is.

*Another order* teaches the same demonstrations backwards, and compares both motions.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.deploy.rollout import roll_out
from farhand.evaluation.human import human_report
from farhand.evaluation.human.human_report import SETS, files, fold, recordings
from farhand.evaluation.metrics.baselines import GRID, PAPER, PrompBaseline, mean_warp
from farhand.evaluation.metrics.motion_metrics import (
    arc_rms,
    dtw_rms,
    end_direction_deg,
    mean_turns,
    resampled_by_length,
    turn_rms_deg,
    turns_of,
)
from farhand.evaluation.study import Case
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import learn

Array = NDArray[np.float64]

_HUMAN_LIKE = 1.5


def cases(trials: int | None, seed: int) -> list[Case]:
    """List all folds of all files; the seed turns and shifts the scenes."""
    every = [
        {"set": name, "file": str(file), "left_out": k, "seed": seed}
        for name in SETS
        for file in files(name)
        for k in range(len(recordings(name, str(file))))
    ]
    return every if trials is None else every[:: max(1, len(every) // trials)][:trials]


def trial(case: Case) -> Case:
    """Measure one fold, as recorded and with two ways to do it."""
    taught, last = fold(case["set"], case["file"], case["left_out"])
    motion = last.in_frame()
    unit = 1e-3 if case["set"] != "lasa" else float(np.ptp(motion, axis=0).max()) / 100.0
    model = learn(taught)
    moved = roll_out(model, _moved(last, case["seed"]))
    reproduced = moved.in_frame()
    unmoved = roll_out(model, last).in_frame()
    same = len(unmoved) == len(reproduced)
    baselines = _baselines(taught, motion)
    backwards = roll_out(learn(taught[::-1]), last).in_frame()
    return {
        **case,
        "task": Path(case["file"]).stem,
        "n_components": model.n_components,
        "moved_m": float(np.abs(unmoved - reproduced).max()) if same else float("inf"),
        "end_m": float(np.linalg.norm(reproduced[-1] - motion[-1])),
        "end_extent": float(np.linalg.norm(reproduced[-1] - motion[-1]) / np.ptp(motion, axis=0).max()),
        "order_extent": float(arc_rms(backwards, unmoved) / np.ptp(motion, axis=0).max()),
        "errors": {
            name: {
                "arc": arc_rms(path, motion) / unit,
                "dtw": dtw_rms(path, motion) / unit,
                "direction_deg": end_direction_deg(path, motion),
            }
            for name, path in {"ours": reproduced, **baselines}.items()
        },
        "turn_deg": _orientation(taught, last, moved) if last.space.oriented else None,
        "human_like": _two_ways(case),
    }


def _orientation(taught: list[Demonstration], last: Demonstration, moved: Demonstration) -> dict[str, float]:
    """Return the errors of the orientation, ours and the warped mean's [deg]."""
    truth = turns_of(last)
    warped = mean_turns([turns_of(d) for d in taught], truth[0])
    return {"ours": turn_rms_deg(turns_of(moved), truth), "mean warp": turn_rms_deg(warped, truth)}


def _moved(demonstration: Demonstration, seed: int) -> Demonstration:
    """Turn and shift the scene of a demonstration at random."""
    random = np.random.default_rng([seed, demonstration.time_s.size])
    if demonstration.n_dims == 2:
        c, s = np.cos(angle := random.uniform(-np.pi, np.pi)), np.sin(angle)
        R = np.array([[c, -s], [s, c]])
    else:
        R = Rotation.random(rng=random).as_matrix()
    shift = random.uniform(-1.0, 1.0, demonstration.n_dims)
    return replace(
        demonstration,
        position_m=demonstration.position_m @ R.T + shift,
        frame_origin_m=demonstration.frame_origin_m @ R.T + shift,
        frame_rotation=R @ demonstration.frame_rotation,
        quat_wxyz=None if demonstration.quat_wxyz is None else _turned(R, demonstration.quat_wxyz),
    )


def _turned(R: Array, quat_wxyz: Array) -> Array:
    turned = Rotation.from_matrix(R) * Rotation.from_quat(quat_wxyz, scalar_first=True)
    return turned.as_quat(scalar_first=True)


def _baselines(taught: list[Demonstration], motion: Array) -> dict[str, Array]:
    """Compute the peers' motions from the same start to the same goal, in the goal's frame."""
    times, motions = [d.time_s for d in taught], [d.in_frame() for d in taught]
    both = ((0.0, motion[0]), (1.0, motion[-1]))
    found = {"paper": PrompBaseline.fit(times, motions, PAPER).motion(*both)}
    for number, promp in enumerate(PrompBaseline.fit_all(times, motions, GRID)):
        found[f"grid {number}"] = promp.motion(*both)
    found["warp"] = mean_warp([resampled_by_length(m, 100) for m in motions], motion[0], motion[-1])
    return found


def _two_ways(case: Case) -> dict[str, bool]:
    """Judge each method's motion when every second person moved the other way round: human-like or not."""
    every = recordings(case["set"], case["file"])
    mixed = [replace(_mirrored(d) if n % 2 else d, quat_wxyz=None) for n, d in enumerate(every)]
    last = mixed.pop(case["left_out"])
    motion, people = last.in_frame(), [d.in_frame() for d in mixed]
    allowed = _HUMAN_LIKE * min(arc_rms(motion, other) for other in people)
    both = ((0.0, motion[0]), (1.0, motion[-1]))
    paths = {
        "ours": roll_out(learn(mixed), last).in_frame(),
        "ProMP": PrompBaseline.fit([d.time_s for d in mixed], people, PAPER).motion(*both),
        "mean warp": mean_warp([resampled_by_length(p, 100) for p in people], motion[0], motion[-1]),
    }
    return {name: min(arc_rms(path, other) for other in people) <= allowed for name, path in paths.items()}


def _mirrored(demonstration: Demonstration) -> Demonstration:
    """Mirror a motion about the line from its start to its goal; in space, turn it by half a turn."""
    start, goal = demonstration.position_m[0], demonstration.position_m[-1]
    along = (goal - start) / np.linalg.norm(goal - start)
    e = demonstration.position_m - start
    return replace(demonstration, position_m=start + 2.0 * np.outer(e @ along, along) - e)


summarise, draw = human_report.summarise, human_report.draw
