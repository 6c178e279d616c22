"""The paper's planar example (Sec. IV, Figs. 2 and 3): three motions into a U, executed while it oscillates.

Per trial: the task's three strokes with the tremor of another hand and 1 mm of noise, learned online; the robot starts at
another place near one of theirs, and sees the oscillating U through a noisy sensor and its filter.
Success: the motion arrives and stays at the true centre of the U, over the 10 s after its arrival, to an
RMS of less than 1 % of the board's side.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import PointTask
from farhand.deploy.places import find_point_task
from farhand.evaluation.metrics.motion_metrics import rms
from farhand.evaluation.metrics.sensor import TRACKER
from farhand.evaluation.metrics.tables import quantiles, rate, table, wilson_interval, write_figure
from farhand.evaluation.paper.closed_loop import Disturbance, PointExecution, execute
from farhand.evaluation.paper.model_figure import draw_components, draw_model
from farhand.evaluation.study import Case, reporting_seeds
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.samples import sample_strokes
from farhand.remote_site.perception.simulated_sight import OscillatingTarget, SimulatedPerception

Array = NDArray[np.float64]

_TRIALS = 100
_AFTER_S = 10.0
_START_STD_M = 0.05
_U_M = 0.05  # half the width of the drawn U


class OscillatingU(Disturbance):
    """Oscillating U as the robot sees it, and its true place."""

    def __init__(self, task: PointTask, seed: int):
        super().__init__(TaskFrame.identity(2))
        phase = np.random.default_rng([seed, 2]).uniform(0.0, 2.0 * np.pi)
        self._target = OscillatingTarget(task.target, phase)
        self._perception = SimulatedPerception.of_oscillating(self._target, task.target.noise_std_m, seed)

    def frame(self, time_s: float, position: Array) -> TaskFrame:
        """See `Disturbance.frame`: as estimated."""
        del position
        return (self._perception.observe(time_s) or [self._frame])[0]

    def truth(self, time_s: Array) -> Array:
        """Return the true centre of the U [m]. Shape (T, 2)."""
        return np.stack([self._target.origin_m(t) for t in time_s])


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one trial per seed."""
    return [{"seed": s} for s in reporting_seeds(seed, trials or _TRIALS)]


def trial(case: Case) -> Case:
    """Demonstrate, learn, execute."""
    task, models, event, executed = _run(case["seed"])
    model = models[-1]
    side = max(task.workspace_m)
    after = executed.time_s > executed.time_s[-1] - _AFTER_S
    error = rms(executed.world[after] - event.truth(executed.time_s[after])) / side
    return {
        **case,
        "n_components": int((~model.terminal).sum()),
        "n_paths": model.n_paths,
        "arrived": executed.arrived,
        "rms_percent": 100.0 * error,
        "success": executed.arrived and error < 0.01,
    }


def _run(seed: int) -> tuple[PointTask, list[TPHSMM], OscillatingU, PointExecution]:
    """Return the task, the model after each demonstration, the U, and the execution."""
    task = find_point_task("planar")
    random = np.random.default_rng([seed, 1])
    noises = np.random.default_rng([seed, 3]).spawn(len(task.samples))
    strokes = [TRACKER.record(s, noise) for s, noise in zip(sample_strokes(task, seed), noises, strict=True)]
    settings = LearnerSettings(task.learning.max_distance_m or 0.22, task.learning.min_std_m)
    learner, models = OnlineLearner(settings, 2, task.frame_names), []
    at = [TaskFrame(np.eye(2), np.array(task.target.origin_m))]
    for stroke in strokes:
        learner.start()
        learner.observe_many(stroke.position_m, at, stroke.time_s.tolist())
        learner.end()
        models.append(learner.model())
    near = strokes[random.integers(len(strokes))].position_m[0]
    event = OscillatingU(task, seed)
    start = near + random.normal(0.0, _START_STD_M, 2)
    return task, models, event, execute(models[-1], start, event, rest_s=_AFTER_S)


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Tabulate success, components and paths."""
    success = [r["success"] for r in results]
    components, paths = [r["n_components"] for r in results], [r["n_paths"] for r in results]
    errors = [r["rms_percent"] for r in results]
    summary = {
        "success_rate": float(np.mean(success)),
        "success_interval": wilson_interval(sum(success), len(success)),
        "n_components": [min(components), float(np.mean(components)), max(components)],
        "three_paths_rate": float(np.mean(np.equal(paths, 3))),
        "rms_percent_median": float(np.median(errors)),
    }
    rows = [
        ("executions that succeed", rate(success), "shown in the video"),
        ("components (terminal one not counted)", f"{min(components)} to {max(components)}", "6"),
        ("models with three paths", rate([p == 3 for p in paths]), "3 paths in its example"),
        ("error after arrival, % of the board, median / 90 %", quantiles(errors), "not given"),
    ]
    return summary, "\n".join(["# Planar example", "", _TEXT, "", table(("", "ours", "paper"), rows)])


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw Figs. 2 and 3 from the first trial."""
    task, models, event, executed = _run(results[0]["seed"])
    figure = Figure(figsize=(12.0, 4.2), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    home = np.array(task.target.origin_m)
    for axes, title in ((left, "a. Demonstrated, learned online"), (middle, "b. Model at the robot's U"), (right, "c. Executed while the U oscillates")):  # fmt: skip
        axes.set(aspect="equal", xlim=(0, 1), ylim=(0, 1), xlabel="x [m]", ylabel="y [m]", title=title)
    for number, stroke in enumerate(sample_strokes(task, results[0]["seed"])):
        _draw_stroke(left, stroke, number)
    _draw_u(left, home, "black")
    draw_components(left, models[-1], home)
    left.legend(loc="lower left", fontsize=8)
    truth = event.truth(executed.time_s)
    draw_components(middle, models[-1], truth[0])
    _draw_u(middle, truth[0], "black")
    middle.plot(*executed.world[0], "s", color="tab:red", label="start")
    middle.legend(loc="lower left", fontsize=8)
    _draw_execution(right, executed, truth)
    write_figure(figure, out_dir / "planar-fig2.png")
    draw_model(models[-1], out_dir / "planar-fig3.png")
    return ["planar-fig2.png", "planar-fig3.png"]


def _draw_stroke(axes: Axes, stroke: Demonstration, number: int) -> None:
    axes.plot(
        *stroke.position_m.T, color="0.3", linewidth=1.2, label="demonstrations" if number == 0 else None
    )
    axes.plot(*stroke.position_m[0], "o", color="0.3", markersize=4)


def _draw_u(axes: Axes, centre: Array, colour: Any, alpha: float = 1.0) -> None:
    corners = np.array([[-1.0, 1.4], [-1.0, -0.7], [1.0, -0.7], [1.0, 1.4]]) * _U_M
    axes.plot(*(centre + corners).T, color=colour, linewidth=3.0, alpha=alpha, solid_capstyle="butt")


def _draw_execution(axes: Axes, executed: PointExecution, truth: Array) -> None:
    axes.plot(*executed.world[0], "s", color="tab:red", label="start")
    axes.plot(*executed.world.T, color="tab:blue", linewidth=1.5, label="robot")
    axes.plot(*truth.T, color="0.6", linewidth=1.0, linestyle=":", label="centre of the U")
    for at in np.linspace(0, len(truth) - 1, 6).astype(int):
        late = 0.25 + 0.75 * at / len(truth)
        _draw_u(axes, truth[at], "black", late)
        axes.plot(*executed.world[at], "o", color="tab:blue", alpha=late, markersize=6)
    axes.legend(loc="lower left", fontsize=8)
