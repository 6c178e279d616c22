"""Synthetic task with two frames, like the paper's example: leave the base, reach for the handle.

Both frames matter, each in its turn. A hand leaves the base along the base's own y axis, and comes to the
handle along the handle's, wherever the two are: a cubic Bezier curve at minimum jerk. It varies as hands do,
in duration and by a slow deviation that fades towards both ends. *Bystanders* are frames that move about
and have nothing to do with the task.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.evaluation.metrics.sensor import TRACKER, Sensor
from farhand.evaluation.paper.approach_task import minimum_jerk
from farhand.local_site.teaching.demonstration import Demonstration

Array = NDArray[np.float64]

LAMBDA_M = 0.10
N_DEMONSTRATIONS = 6

_PERIOD_S, _DURATION_S = 0.02, 4.0
_DURATION_SPREAD = 0.1  # of the logarithm
_STRAIGHT_M = 0.35  # how far out along the axes the curve's control points lie
_DEVIATION_M = 0.008  # of the hand, by its first harmonic
_HANDLE_M = np.array([0.8, 0.3])  # where the handle is on average, seen from the base's
_REACH_M, _TURN_RAD = 0.15, 0.4  # how far the frames are from there, and turned, at most
_N_PATH = 400


@dataclass(frozen=True)
class HandleScene:
    """Task frames of one scene.

    Args:
        base: Frame whose y axis is the way out.
        handle: Frame whose y axis points to where the hand comes from.
        bystander: Frame that has nothing to do with the task.
        passer_by: Another frame that has nothing to do with it.
    """

    base: TaskFrame
    handle: TaskFrame
    bystander: TaskFrame
    passer_by: TaskFrame

    def frames(self, names: tuple[str, ...]) -> list[TaskFrame]:
        """Return the frames of these names."""
        return [getattr(self, name) for name in names]

    def path(self) -> Array:
        """Return the path that every hand intends to follow. Shape (400, 2) [m]."""
        s = np.linspace(0.0, 1.0, _N_PATH)[:, None]
        begin, end = self.base.b, self.handle.b
        out, before = begin + _STRAIGHT_M * self.base.A[:, 1], end + _STRAIGHT_M * self.handle.A[:, 1]
        return (1 - s) ** 3 * begin + 3 * (1 - s) ** 2 * s * out + 3 * (1 - s) * s**2 * before + s**3 * end


def random_scene(random: np.random.Generator) -> HandleScene:
    """Draw base, handle and bystanders within reach, with reasonable rotations."""
    return HandleScene(
        _random_frame(random, np.zeros(2), 0.4 * _REACH_M),
        _random_frame(random, _HANDLE_M, _REACH_M),
        _random_frame(random, 0.5 * _HANDLE_M, 2.0 * _REACH_M),
        _random_frame(random, 0.5 * _HANDLE_M, 2.0 * _REACH_M),
    )


def demonstrate(
    random: np.random.Generator, scene: HandleScene, names: tuple[str, ...], sensor: Sensor = TRACKER
) -> Demonstration:
    """Return one demonstration in a scene, seen from the frames of these names; the last is the goal's."""
    noise = random.spawn(1)[0]
    duration_s = _DURATION_S * float(np.exp(random.normal(0.0, _DURATION_SPREAD)))
    time_s = np.arange(0.0, duration_s, _PERIOD_S)
    path = scene.path()
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    travelled = minimum_jerk(time_s / time_s[-1])
    position = np.stack([np.interp(along[-1] * travelled, along, axis) for axis in path.T], axis=1)
    harmonics = np.arange(1, 4)
    position += np.sin(np.pi * travelled[:, None] * harmonics) @ (
        random.normal(0.0, _DEVIATION_M, (3, 2)) / harmonics[:, None]
    )
    frames = scene.frames(names)
    hand = Demonstration(
        time_s=time_s,
        position_m=position,
        frame_origin_m=np.stack([f.b for f in frames]),
        frame_rotation=np.stack([f.A for f in frames]),
        frame_names=names,
        source="synthetic reach for a handle",
    )
    return sensor.record(hand, noise)


def _random_frame(random: np.random.Generator, around: Array, reach_m: float) -> TaskFrame:
    angle = random.uniform(-_TURN_RAD, _TURN_RAD)
    turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return TaskFrame(turned, around + random.uniform(-reach_m, reach_m, 2))
