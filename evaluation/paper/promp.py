"""Our method beside ProMP, a regression, a warped mean demonstration and a straight line (Sec. VI-A, Fig. 8).

Five demonstrations of the synthetic approach. *Seen*: each method starts where a demonstration did and is
compared with what the hand really did. *New*: start and receptacle are new, and the reference is what the same hand would have
done there. Both root mean square errors are given: at equal fractions of the time, and along dynamic time
warping. ProMP has the paper's 15 basis functions, alignment by dynamic time warping and regularisation 1e-3,
in the receptacle's frame and in the world's; "best of grid" is the one of 18 settings (10, 15, 25 basis
functions, three regularisations, with and without alignment; receptacle's frame) that suits these very
trials best by the error along dynamic time warping. *Least squares on the start* regresses whole motions on where
they began, without any restriction: at seen starts no method that is linear in the start comes nearer to the
demonstrations, which vary by more than their starts say. Ours uses one setting, lambda = 0.10 m.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.evaluation.metrics.baselines import (
    GRID,
    PAPER,
    PrompBaseline,
    mean_warp,
    regression_on_start,
    straight_line,
)
from farhand.evaluation.metrics.motion_metrics import (
    approach_of,
    at_phases,
    dtw_rms,
    spectral_arc_length,
    time_rms,
)
from farhand.evaluation.metrics.tables import quantiles, rate, spread, table, wilson_interval, write_figure
from farhand.evaluation.paper.approach_task import FAR_STARTS, TAUGHT_STARTS, demonstrate, random_frame
from farhand.evaluation.paper.approach_trials import hands, stepping, taught
from farhand.evaluation.paper.closed_loop import Disturbance, execute
from farhand.evaluation.study import Case, by_value, reporting_seeds
from farhand.local_site.teaching.demonstration import Demonstration

Array = NDArray[np.float64]
Motion = tuple[Array, Array]  # times (T,) [s], positions in the receptacle's frame (T, 3) [m]

_TRIALS = 60  # trials of seen and of new starts
_N = 200
OURS, STEP, RECEPTACLE, WORLD = "ours", "ours, step reference", "ProMP, receptacle's frame", "ProMP, world"
BEST, WARP, LINE = "ProMP, best of grid", "mean warp", "straight line"
REGRESSION = "least squares on the start"
METHODS = (OURS, STEP, RECEPTACLE, BEST, WORLD, REGRESSION, WARP, LINE)
PARTS = ("seen", "new", "far")


def cases(trials: int | None, seed: int) -> list[Case]:
    """List seen, new and far starts with the same seeds."""
    return [{"seed": s, "part": part} for part in PARTS for s in reporting_seeds(seed, trials or _TRIALS)]


def trial(case: Case) -> Case:
    """Run all methods at one start, and compare each with the hand's motion there."""
    shown, like = scene(case["seed"], case["part"])
    first = like.in_frame()[0]
    nearest = min(float(np.linalg.norm(first - d.in_frame()[0])) for d in shown)
    measured = {
        name: _measure(motion, like) for name, motion in motions(case["seed"], shown, like, grid=True).items()
    }
    return {**case, "distance_m": nearest, **measured}


def scene(seed: int, part: str) -> tuple[list[Demonstration], Demonstration]:
    """Return the demonstrations, and the motion to compare with."""
    shown, _ = taught(seed)
    if part == "seen":
        return shown, hands(seed)[seed % len(shown)]
    random = np.random.default_rng([seed, 1])
    start = (TAUGHT_STARTS if part == "new" else FAR_STARTS).sample(random)
    return shown, demonstrate(random, start, random_frame(random))


def motions(seed: int, shown: list[Demonstration], like: Demonstration, grid: bool) -> dict[str, Motion]:
    """Return each method's motion from the start of a motion to its receptacle."""
    _, model = taught(seed)
    frame, start = like.frames_at(0)[0], like.position_m[0]
    ours = {
        OURS: execute(model, start, Disturbance(frame)),
        STEP: execute(stepping(model), start, Disturbance(frame)),
    }
    found = {name: (done.time_s, done.local) for name, done in ours.items()}
    duration_s = float(np.mean([np.ptp(d.time_s) for d in shown]))
    at = np.linspace(0.0, duration_s, _N)
    times, local = [d.time_s for d in shown], [d.in_frame() for d in shown]
    begin, mouth = frame.to_local(start), np.zeros(3)
    both = ((0.0, begin), (1.0, mouth))
    found[RECEPTACLE] = (at, PrompBaseline.fit(times, local, PAPER).motion(*both, n_points=_N))
    world = PrompBaseline.fit(times, [d.position_m for d in shown], PAPER)
    found[WORLD] = (at, frame.to_local(world.motion((0.0, start), (1.0, frame.b), n_points=_N)))
    phased = [at_phases(t, p, _N) for t, p in zip(times, local, strict=True)]
    found[REGRESSION] = (at, regression_on_start(phased, begin))
    found |= {WARP: (at, mean_warp(phased, begin, mouth)), LINE: (at, straight_line(begin, mouth, _N))}
    for number, promp in enumerate(PrompBaseline.fit_all(times, local) if grid else ()):
        found[f"grid {number}"] = (at, promp.motion(*both, n_points=_N))
    return found


def _measure(motion: Motion, like: Demonstration) -> Case:
    time_s, local = motion
    approach = approach_of(local)
    return {
        "time_rms_m": time_rms(time_s, local, like.time_s, like.in_frame()),
        "dtw_rms_m": dtw_rms(local, like.in_frame()),
        "angle_deg": approach.angle_deg,
        "lateral_m": approach.lateral_m,
        "success": approach.success,
        "smoothness": spectral_arc_length(time_s, local),
        "duration_ratio": float(np.ptp(time_s) / np.ptp(like.time_s)),
    }


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make one table each for seen, new and far starts."""
    summary: Case = {}
    lines = ["# Ours and ProMP", "", (__doc__ or "").split("\n", 1)[1].strip()]
    header = ("", "RMSE, time [cm]", "RMSE, DTW [cm]", "off the axis [deg], median / 90 %", "success", "smoothness", "duration ratio")  # fmt: skip
    titles = {"seen": "Seen starts", "new": "New starts and receptacles", "far": "Far starts"}
    for part, rows_of in by_value(results, "part", PARTS).items():
        chosen = _best_of_grid(rows_of)
        rows = []
        for name in METHODS:
            column = [r[chosen if name == BEST else name] for r in rows_of]
            success = [c["success"] for c in column]
            summary[f"{part}, {name}"] = {
                **{key: float(np.mean([c[key] for c in column])) for key in column[0]},
                "success_interval": wilson_interval(sum(success), len(success)),
            }
            rows.append(
                (
                    name,
                    spread([c["time_rms_m"] for c in column], 100),
                    spread([c["dtw_rms_m"] for c in column], 100),
                    quantiles([c["angle_deg"] for c in column]),
                    rate(success),
                    spread([c["smoothness"] for c in column]),
                    spread([c["duration_ratio"] for c in column]),
                )
            )
        setting = GRID[int(chosen.split()[1])]
        lines += ["", f"## {titles[part]}", "", table(header, rows), "", f"Best of the grid here: {setting}."]
    return summary, "\n".join([*lines, "", _NOTE])


_NOTE = """\
Success: end within 3 mm of the mouth, the last 5 cm within 5 degrees of the axis and 5 mm beside it.
Smoothness: spectral arc length, the nearer to zero the smoother; one stroke of a hand has -1.4. The
durations of ProMP, warp and line are the mean of the demonstrations by construction."""


def _best_of_grid(rows: list[Case]) -> str:
    names = [f"grid {number}" for number in range(len(GRID))]
    return min(names, key=lambda name: np.mean([r[name]["dtw_rms_m"] for r in rows]))


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw Fig. 8, and the error against the distance from the data."""
    figure = Figure(figsize=(12.0, 4.2), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    for axes, part in ((left, "seen"), (middle, "far")):
        for number, case in enumerate([r for r in results if r["part"] == part][:4]):
            _draw_motions(axes, case["seed"], part, number == 0)
        axes.set(
            aspect="equal", xlabel="beside the axis [m]", ylabel="along the axis [m]", title=f"{part} starts"
        )
    left.legend(fontsize=8)
    for name, colour in ((OURS, "tab:blue"), (RECEPTACLE, "tab:purple"), (WARP, "tab:green")):
        unseen = [r for r in results if r["part"] != "seen"]
        right.plot([r["distance_m"] for r in unseen], [r[name]["angle_deg"] for r in unseen], "o", color=colour, alpha=0.6, markersize=4, label=name)  # fmt: skip
    right.axhline(5.0, color="tab:red", linestyle="--", linewidth=1.0)
    right.set(xlabel="distance from the nearest demonstrated start [m]", ylabel="approach off the axis [deg]", yscale="log")  # fmt: skip
    right.legend(fontsize=8)
    write_figure(figure, out_dir / "promp.png")
    return ["promp.png"]


def _draw_motions(axes, seed: int, part: str, named: bool) -> None:
    shown, like = scene(seed, part)
    sideways = np.array([*TaskFrame.identity(3).to_local(like.in_frame()[0])[:2], 0.0])
    sideways /= np.linalg.norm(sideways)
    lines = [((like.time_s, like.in_frame()), "0.6", "the hand", 2.5)]
    found = motions(seed, shown, like, grid=False)
    lines += [(found[OURS], "tab:blue", OURS, 1.2), (found[RECEPTACLE], "tab:purple", RECEPTACLE, 1.2)]
    for (_, local), colour, name, width in lines:
        label = name if named else None
        axes.plot(local @ sideways, local[:, 2], color=colour, linewidth=width, label=label)
