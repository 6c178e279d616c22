"""Jump of the receptacle half way (Fig. 7, right): our executor beside a ProMP that is conditioned again.

Half way through the motion the receptacle jumps by 12 cm and turns by 20 degrees, seen without delay. Ours
goes on, with the new frame. A ProMP is conditioned on the start and the receptacle; at the jump it is
conditioned on where the robot is and on the new receptacle, in the receptacle's frame (where it was learned
as ours was), or in the world as in the paper.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.evaluation.metrics.baselines import PAPER, PrompBaseline
from farhand.evaluation.metrics.motion_metrics import Approach, approach_of
from farhand.evaluation.metrics.tables import quantiles, rate, table, wilson_interval, write_figure
from farhand.evaluation.paper.approach_task import (
    TAUGHT_STARTS,
    random_direction,
    random_frame,
    random_rotation,
)
from farhand.evaluation.paper.approach_trials import taught
from farhand.evaluation.paper.closed_loop import Disturbance, execute
from farhand.evaluation.study import Case, reporting_seeds
from farhand.local_site.teaching.demonstration import Demonstration

Array = NDArray[np.float64]

_TRIALS = 100
_JUMP_M, _JUMP_RAD = 0.12, np.radians(20.0)
_N = 200  # points of a ProMP's motion
METHODS = ("ours", "ProMP, receptacle's frame", "ProMP, world")


class HalfwayJump(Disturbance):
    """Jump of the receptacle at a time."""

    def __init__(self, before: TaskFrame, after: TaskFrame, at_s: float):
        super().__init__(before)
        self._after, self._at_s = after, at_s

    def frame(self, time_s: float, position: Array) -> TaskFrame:
        """See `Disturbance.frame`."""
        return self._after if time_s >= self._at_s else super().frame(time_s, position)


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one scene per seed, for all methods."""
    return [{"seed": s} for s in reporting_seeds(seed, trials or _TRIALS)]


def trial(case: Case) -> Case:
    """Judge all methods in one scene."""
    _, after, motions = motions_of(case["seed"])
    return {**case, **{name: _judged(approach_of(after.to_local(path))) for name, path in motions.items()}}


def _judged(approach: Approach) -> Case:
    return {**approach._asdict(), "success": approach.success}


def motions_of(seed: int) -> tuple[TaskFrame, TaskFrame, dict[str, Array]]:
    """Return the receptacle before and after, and each method's motion in the world (T, 3) [m]."""
    shown, model = taught(seed)
    random = np.random.default_rng([seed, 1])
    before = random_frame(random)
    after = TaskFrame(
        random_rotation(random, _JUMP_RAD) @ before.A, before.b + _JUMP_M * random_direction(random)
    )
    start = before.to_world(TAUGHT_STARTS.sample(random))
    half_s = 0.5 * float(np.mean([np.ptp(d.time_s) for d in shown]))
    executed = execute(model, start, HalfwayJump(before, after, half_s), rest_s=1.0)
    promp = [_conditioned_anew(shown, start, before, after, in_world) for in_world in (False, True)]
    return before, after, dict(zip(METHODS, (executed.world, *promp), strict=True))


def _conditioned_anew(
    shown: list[Demonstration], start: Array, before: TaskFrame, after: TaskFrame, in_world: bool
) -> Array:
    """Return a ProMP's motion in the world, conditioned again at half time. Shape (N, 3)."""
    motions = [d.position_m if in_world else d.in_frame() for d in shown]
    promp = PrompBaseline.fit([d.time_s for d in shown], motions, PAPER)
    world = TaskFrame.identity(3)
    first, second = (world, world) if in_world else (before, after)
    goals = (before.b, after.b) if in_world else (np.zeros(3), np.zeros(3))
    planned = promp.motion((0.0, first.to_local(start)), (1.0, goals[0]), n_points=_N)
    done = first.to_world(planned[: _N // 2])
    here, phase = second.to_local(done[-1]), (_N // 2 - 1) / (_N - 1)
    rest = promp.motion((phase, here), (1.0, goals[1]), n_points=_N)
    return np.concatenate([done, second.to_world(rest[_N // 2 :])])


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Tabulate each method's success and approach."""
    summary: Case = {}
    rows = []
    for name in METHODS:
        column = {key: [r[name][key] for r in results] for key in results[0][name]}
        success = column["success"]
        summary[name] = {
            "success_rate": float(np.mean(success)),
            "success_interval": wilson_interval(sum(success), len(success)),
            "median_end_m": float(np.median(column["end_m"])),
            "median_angle_deg": float(np.median(column["angle_deg"])),
        }
        rows.append(
            (
                name,
                rate(success),
                quantiles(column["end_m"], 1e3),
                quantiles(column["angle_deg"]),
                quantiles(column["lateral_m"], 1e3),
            )
        )
    header = (
        "",
        "success",
        "end [mm], median / 90 %",
        "approach off the axis [deg]",
        "lateral, last 5 cm [mm]",
    )
    note = "Success: end within 3 mm, direction of the last 5 cm within 5 degrees of the axis, and within 5 mm beside it."
    return summary, "\n".join(["# A target that moves", "", _TEXT, "", table(header, rows), "", note])


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw Fig. 7 (right) in two scenes, in the plane of the new receptacle's axis and the start."""
    figure = Figure(figsize=(10.0, 4.6), layout="constrained")
    for axes, case in zip(figure.subplots(1, 2), results[:2] * 2, strict=False):
        before, after, motions = motions_of(case["seed"])
        start = after.to_local(motions["ours"][0])
        sideways = np.array([start[0], start[1], 0.0]) / np.hypot(start[0], start[1])
        for (name, path), colour in zip(motions.items(), ("tab:blue", "tab:purple", "tab:pink"), strict=True):
            local = after.to_local(path)
            axes.plot(local @ sideways, local[:, 2], color=colour, label=name)
        old = after.to_local(before.b)
        tip = after.to_local(before.to_world(np.array([0.0, 0.0, 0.1])))
        axes.plot([old @ sideways, tip @ sideways], [old[2], tip[2]], color="0.6", linestyle=":")
        axes.plot(old @ sideways, old[2], "v", color="0.6", markersize=9, label="receptacle before")
        axes.plot([0.0, 0.0], [0.0, 0.1], color="black", linestyle=":")
        axes.plot(0.0, 0.0, "v", color="black", markersize=9, label="receptacle after")
        axes.plot(start @ sideways, start[2], "s", color="tab:red", label="start")
        axes.set(aspect="equal", xlabel="beside the axis [m]", ylabel="along the axis [m]")
    figure.axes[1].legend(fontsize=8, loc="lower right")
    write_figure(figure, out_dir / "moving-target.png")
    return ["moving-target.png"]
