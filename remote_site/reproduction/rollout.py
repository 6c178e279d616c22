"""A model rolled out on the point plant, faster than real time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.task_frame import TaskFrame
from common.tphsmm import TPHSMM
from remote_site.reproduction.executor import Executor, ExecutorSettings

Array = NDArray[np.float64]

# An execution that takes longer than so many times what was demonstrated has stalled.
_PATIENCE = 3.0
_PATIENCE_S = 5.0


@dataclass(frozen=True, eq=False)
class Rollout:
    """A motion that the executor made.

    Args:
        time_s: From zero [s]. Shape (T,).
        position_m: In the world [m]. Shape (T, D).
        components: Component of each sample. Shape (T,).
        arrived: Whether it came to its end; if not, it was given up.
    """

    time_s: Array
    position_m: Array
    components: NDArray[np.int64]
    arrived: bool


def roll_out(
    model: TPHSMM,
    start: Array,
    frames_at: Callable[[float], Sequence[TaskFrame]],
    settings: ExecutorSettings | None = None,
) -> Rollout:
    """Execute a model from rest, on a unit mass that does exactly what it is told.

    Args:
        model: The learned task.
        start: Where the point rests at first [m]. Shape (D,).
        frames_at: The task frames at a time from the start [s].
        settings: Of the executor.
    """
    settings = settings or ExecutorSettings()
    dt = settings.dt_s
    executor = Executor(model, settings)
    p, v, t = np.asarray(start, dtype=float), np.zeros(model.n_dims), 0.0
    executor.begin(p, v, frames_at(0.0))
    limit_s = _PATIENCE * executor.remaining_s + _PATIENCE_S
    times, positions, components, arrived = [0.0], [p], [executor.state().progress.component], False
    while not arrived and t < limit_s:
        control = executor.step(p, v, frames_at(t))
        p, v = p + dt * v + 0.5 * dt**2 * control.acceleration, v + dt * control.acceleration  # Eq. 2
        t, arrived = t + dt, control.arrived
        times.append(t)
        positions.append(p)
        components.append(control.component)
    return Rollout(np.array(times), np.stack(positions), np.array(components), arrived)
