"""Sample demonstrations of a task, drawn the way a hand draws: smooth, slow at both ends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import PointTask, Sample
from farhand.local_site.teaching.demonstration import Demonstration

Array = NDArray[np.float64]

_PERIOD_S = 0.02
_TREMOR_M = 0.004


def sample_strokes(task: PointTask, seed: int | None = None) -> list[Demonstration]:
    """Return the task's demonstrations, towards a target that stands still at its mean place.

    Args:
        task: The task.
        seed: Seed of a slow, slight deviation of the hand that vanishes at both ends; None for none.
    """
    random = np.random.default_rng(seed) if seed is not None else None
    return [_stroke(task, sample, random) for sample in task.samples]


def still_frames(task: PointTask) -> list[TaskFrame]:
    """Return the task frames on the operator's side. Length P."""
    return [TaskFrame.at(np.array(task.target.origin_m))] * len(task.frame_names)


def _stroke(task: PointTask, sample: Sample, random: np.random.Generator | None) -> Demonstration:
    """Return a spline through the waypoints under the minimum-jerk law of a hand."""
    from scipy.interpolate import CubicSpline  # its import takes longer than the rest of a site's start

    points = np.array(sample.waypoints_m)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    time_s = np.arange(0.0, sample.duration_s + 0.5 * _PERIOD_S, _PERIOD_S)
    tau = np.minimum(time_s / sample.duration_s, 1.0)
    part = tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)
    position = CubicSpline(along, points)(part * along[-1])
    if random is not None:
        for harmonic in (1, 2, 3):
            amplitude = random.normal(0.0, _TREMOR_M / harmonic, points.shape[1])
            position = position + np.sin(np.pi * harmonic * part)[:, None] * amplitude
    return Demonstration.within(still_frames(task), task.frame_names, time_s, position)
