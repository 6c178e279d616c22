"""Two task frames: leave the base along its axis, come to the handle along the handle's.

    python -m examples.reach_handle.reach_handle [FILE.png]

Six demonstrations with base and handle elsewhere in each; then the motion in a scene that was never shown,
and in one whose handle moves away meanwhile.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.evaluation.paper.handle_task import (
    LAMBDA_M,
    N_DEMONSTRATIONS,
    HandleScene,
    demonstrate,
    random_scene,
)
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.remote_site.reproduction.point_rollout import Rollout, roll_out

NAMES = ("base", "handle")


def learn(random: np.random.Generator) -> tuple[TPHSMM, list[Demonstration]]:
    """Return the model, and the demonstrations that it was learned from."""
    learner, shown = OnlineLearner(LearnerSettings(LAMBDA_M), 2, NAMES), []
    for _ in range(N_DEMONSTRATIONS):
        shown.append(demonstrate(random, random_scene(random), NAMES))
        learner.start()
        learner.observe_many(shown[-1].position_m, shown[-1].frames_at(0), shown[-1].time_s)
        learner.end()
    return learner.model(), shown


def learn_from_each_frame(shown: list[Demonstration]) -> TPHSMM:
    """Return the same model when every frame has its own observations and their places are unknown."""
    learner = OnlineLearner(LearnerSettings(LAMBDA_M), 2, NAMES)
    for demonstration in shown:
        frames = demonstration.frames_at(0)
        local = np.stack([frame.to_local(demonstration.position_m) for frame in frames], axis=1)
        learner.start()
        learner.observe_in_frames(local, demonstration.time_s)
        learner.end()
    return learner.model()


def reach(model: TPHSMM, scene: HandleScene, drift_m_s: float = 0.0) -> Rollout:
    """Execute the model from the base, while the handle drifts away along its own x axis."""

    def frames_at(time_s: float) -> list[TaskFrame]:
        handle = scene.handle
        return [scene.base, TaskFrame(handle.A, handle.b + drift_m_s * time_s * handle.A[:, 0])]

    return roll_out(model, scene.base.b, frames_at)


def main(file: Path) -> None:
    """Learn, reach, draw."""
    random = np.random.default_rng(1)
    model, shown = learn(random)
    figure = Figure(figsize=(9.6, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    for demonstration in shown:
        left.plot(*demonstration.position_m.T, color="0.6")
        _draw_frames(left, demonstration.frames_at(0))
    title = f"{len(shown)} demonstrations, {model.n_components} components"
    left.set(title=title, xlabel="x [m]", ylabel="y [m]", aspect="equal")
    scene = random_scene(random)
    for drift_m_s, style in ((0.0, "-"), (0.03, "--")):
        motion = reach(model, scene, drift_m_s)
        label = f"handle drifts by {drift_m_s:g} m/s, arrived: {motion.arrived}"
        right.plot(*motion.position_m.T, style, label=label)
    right.plot(*scene.path().T, "k:", label="as the hand means to go")
    _draw_frames(right, [scene.base, scene.handle])
    right.legend(fontsize=8)
    right.set(title="a scene that was never shown", xlabel="x [m]", aspect="equal")
    figure.savefig(file, dpi=110)
    sys.stdout.write(f"written: {file}\n")


def _draw_frames(axes: Axes, frames: list[TaskFrame]) -> None:
    for frame, colour in zip(frames, ("tab:blue", "tab:red"), strict=True):
        axes.quiver(*frame.b, *frame.A[:, 1], color=colour, scale=12, width=0.006)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "reach_handle.png"))
