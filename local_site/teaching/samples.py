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
_N_PARTS = 201


def sample_strokes(task: PointTask, seed: int | None = None) -> list[Demonstration]:
    """Return the task's demonstrations, among frames that stand still: at their usual places, then at others.

    Args:
        task: The task.
        seed: Seed of a slow, slight deviation of the hand that vanishes at both ends; None for none.
    """
    random = np.random.default_rng(seed) if seed is not None else None
    return [_stroke(task, sample, place, random) for place, sample in enumerate(task.samples)]


def still_frames(task: PointTask, place: int = 0) -> list[TaskFrame]:
    """Return the task frames on the operator's side. Length P.

    Args:
        task: The task.
        place: Seed of their places; 0 for the usual ones.
    """
    return [TaskFrame.at(mean) for mean in task.means_m(place)]


def _stroke(task: PointTask, sample: Sample, place: int, random: np.random.Generator | None) -> Demonstration:
    """Return a spline through the waypoints under the minimum-jerk law of a hand, which follows the frames."""
    from scipy.interpolate import CubicSpline  # its import takes longer than the rest of a site's start

    points = np.array(sample.waypoints_m)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    time_s = np.arange(0.0, sample.duration_s + 0.5 * _PERIOD_S, _PERIOD_S)
    tau = np.minimum(time_s / sample.duration_s, 1.0)
    part = tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)
    way = CubicSpline(along, points)
    position = way(part * along[-1])
    if task.varies:
        position = position + _followed(task, way(np.linspace(0.0, along[-1], _N_PARTS)), place, part)
    if random is not None:
        for harmonic in (1, 2, 3):
            amplitude = random.normal(0.0, _TREMOR_M / harmonic, points.shape[1])
            position = position + np.sin(np.pi * harmonic * part)[:, None] * amplitude
    return Demonstration.within(still_frames(task, place), task.frame_names, time_s, position)


def _followed(task: PointTask, way: Array, place: int, part: Array) -> Array:
    """Return how a hand deviates that passes each frame as it does at the usual places. Shape (T, D) [m].

    Args:
        task: The task.
        way: Way at the usual places, in even steps. Shape (n, D) [m].
        place: Seed of the frames' places.
        part: Part of the way at each sample. Shape (T,).
    """
    usual, there = task.means_m(0), task.means_m(place)
    nearest = [int(np.argmin(np.linalg.norm(way - origin, axis=1))) for origin in usual]
    order = np.argsort(nearest, kind="stable")
    knots = np.array([0.0, *(nearest[j] / (len(way) - 1) for j in order)])
    moved = np.vstack([np.zeros(task.n_dims), (there - usual)[order]])
    return np.column_stack([np.interp(part, knots, axis) for axis in moved.T])
