"""A task for the executor's tests: three ways down into a goal at the origin of the task frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.remote_site.reproduction.executor import Executor

Array = NDArray[np.float64]
DT = 0.02
STARTS = ((-0.7, 0.2), (-0.5, 0.7), (-0.1, 0.85))


def descent(start: tuple[float, float], n: int = 200) -> Array:
    """From a start to above the goal, then straight down. Shape (n, 2)."""
    tau = np.linspace(0.0, 1.0, n)
    s = (10 * tau**3 - 15 * tau**4 + 6 * tau**5)[:, None]
    return (
        (1 - s) ** 3 * np.array(start)
        + 3 * s * (1 - s) ** 2 * np.array([-0.1, 0.5])
        + 3
        * s**2
        * (1 - s)
        * [
            0.0,
            0.25,
        ]
    )


def descents(max_distance_m: float = 0.15) -> TPHSMM:
    """The learned model."""
    learner = OnlineLearner(LearnerSettings(max_distance_m, min_std_m=0.005), 2, ["goal"])
    for start in STARTS:
        learner.start()
        points = descent(start)
        learner.observe_many(points, [TaskFrame.identity(2)], (DT * np.arange(float(len(points)))).tolist())
        learner.end()
    return learner.model()


@dataclass(frozen=True)
class Run:
    """What happened: positions (T, D) [m], when it arrived [s], and the commands (T, D) [m/s^2]."""

    positions: Array
    arrived_s: float | None
    commands: Array


def run(
    executor: Executor,
    start: Array,
    frames_at: Callable[[float], list[TaskFrame]],
    duration_s: float,
    disturb: Callable[[float, Array], Array] | None = None,
) -> Run:
    """Execute on a unit mass; `disturb` may put it elsewhere."""
    p, v = np.array(start, dtype=float), np.zeros(len(start))
    executor.begin(p, v, frames_at(0.0))
    positions, commands, arrived_s = [], [], None
    for n in range(round(duration_s / DT)):
        t = n * DT
        if disturb is not None:
            p = disturb(t, p)
        control = executor.step(p, v, frames_at(t))
        u = control.acceleration
        p, v = p + DT * v + 0.5 * DT**2 * u, v + DT * u
        positions.append(p)
        commands.append(u)
        if control.arrived and arrived_s is None:
            arrived_s = t
    return Run(np.array(positions), arrived_s, np.array(commands))


def still(b: Array | None = None, angle: float = 0.0) -> list[TaskFrame]:
    """One planar task frame."""
    c, s = np.cos(angle), np.sin(angle)
    return [TaskFrame(np.array([[c, -s], [s, c]]), np.zeros(2) if b is None else b)]
