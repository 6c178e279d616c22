"""Rollout of a model on the point plant, faster than real time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidModel
from farhand.common.model.manifold import Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings

Array = NDArray[np.float64]

# An execution that takes longer than this multiple of the demonstrated time has stalled.
_PATIENCE = 3.0
_PATIENCE_S, _MOST_PATIENCE_S = 5.0, 60.0
LONGEST_S = 300.0
"""Longest duration of a motion [s]."""


@dataclass(frozen=True, eq=False)
class Rollout:
    """Motion made by the executor.

    Args:
        time_s: Times, from zero [s]. Shape (T,).
        points: Positions or poses in the world. Shape (T, C).
        components: Component of each sample. Shape (T,).
        arrived: True if it reached its end, False if it was given up.
        space: Positions or poses.
    """

    time_s: Array
    points: Array
    components: NDArray[np.int64]
    arrived: bool
    space: Manifold

    @property
    def position_m(self) -> Array:
        """Positions in the world [m]. Shape (T, D)."""
        return self.points[:, : self.space.n_dims]

    @property
    def quat_wxyz(self) -> Array | None:
        """Orientations in the world, of a model of poses. Shape (T, 4)."""
        return self.points[:, self.space.n_dims :] if self.space.oriented else None


def roll_out(
    model: TPHSMM,
    start: Array,
    frames_at: Callable[[float], Sequence[TaskFrame]],
    settings: ExecutorSettings | None = None,
) -> Rollout:
    """Execute a model from rest, on a unit mass that does exactly what it is told.

    Args:
        model: The learned task.
        start: Point of rest at the beginning. Shape (C,).
        frames_at: Returns the task frames at a time since the start [s].
        settings: Settings of the executor.

    Raises:
        InvalidModel: When the motion would take longer than anybody demonstrates.
    """
    settings = settings or ExecutorSettings()
    dt = settings.dt_s
    executor = Executor(model, settings)
    space = model.manifold
    p, v, t = space.checked(start, "rollout", "start"), np.zeros(space.n_tangent), 0.0
    executor.begin(p, v, frames_at(0.0))
    if not (expected_s := executor.remaining_s) <= LONGEST_S:
        expected = (
            f"a motion of at most {LONGEST_S:g} s, got {expected_s:g} s; were its times in milliseconds?"
        )
        raise InvalidModel("model", "duration_mean_s", expected)
    limit_s = expected_s + min((_PATIENCE - 1.0) * expected_s + _PATIENCE_S, _MOST_PATIENCE_S)
    times, points, components, arrived = [0.0], [p], [executor.state().progress.component], False
    while not arrived and t < limit_s:
        control = executor.step(p, v, frames_at(t))
        u = control.acceleration
        p, v = space.exp(p, dt * v + 0.5 * dt**2 * u), v + dt * u  # Eq. 2
        t, arrived = t + dt, control.arrived
        times.append(t)
        points.append(p)
        components.append(control.component)
    return Rollout(np.array(times), np.stack(points), np.array(components), arrived, space)
