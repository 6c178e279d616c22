"""Clock, point plant and sight that whoever holds them steers: time, force, pushes, what is seen and where."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import PointTask
from farhand.remote_site.interface.plant import EffectorState, PointPlant

Array = NDArray[np.float64]


class SteppedTime:
    """Source of time for a `BootClock`; it advances only when told [ns].

    Args:
        start_s: First time [s].
    """

    def __init__(self, start_s: float = 100.0):
        self.ns = round(start_s * 1e9)

    def __call__(self) -> int:
        """Return the present time [ns]."""
        return self.ns

    def advance(self, duration_s: float) -> None:
        """Advance the time [s]."""
        self.ns += round(duration_s * 1e9)


class PushedPlant(PointPlant):
    """Point with a settable force on its tool.

    Args:
        task: Task whose start, workspace and limits the point has.
        position_m: Position, if it is not the task's start [m]. Shape (D,).
    """

    def __init__(self, task: PointTask, position_m: Array | None = None):
        limits = task.limits
        start_m = np.array(task.start_m) if position_m is None else position_m
        super().__init__(start_m, np.array(task.workspace_m), limits.speed_m_s, limits.acceleration_m_s2)
        self.force_n: Array | None = np.zeros(task.n_dims)
        """Force on the tool [N]; None for a plant that measures none. Shape (D,)."""

    def read(self) -> EffectorState:
        """See `Plant.read`."""
        return replace(super().read(), load=self.force_n)

    def push_to(self, position_m: tuple[float, ...]) -> None:
        """Put the robot at another place while it stands [m]."""
        self._position = np.array(position_m)


class SteeredSight:
    """Perception whose frame can be hidden, shifted, turned and broken.

    Args:
        see: Returns the frame at a time [s], or None while it is out of sight.
        truth_m: Returns the frame's true origin at a time [m].
    """

    def __init__(
        self,
        see: Callable[[float], TaskFrame | None],
        truth_m: Callable[[float], Array | None] = lambda _: None,
    ):
        self._see, self._truth_m = see, truth_m
        self.seen, self.broken = True, False
        self.shift_m: Array | None = None
        self.turn_rad = 0.0

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        """See `Perception.observe`."""
        frame = self._see(now_s)
        if not self.seen or frame is None:
            return None
        matrix, origin_m = frame.A, frame.b
        if self.turn_rad:
            c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
            matrix = np.array([[c, -s], [s, c]])
        if self.shift_m is not None:
            origin_m = origin_m + self.shift_m
        return [TaskFrame(matrix, origin_m * np.nan if self.broken else origin_m)]

    def true_origin_m(self, now_s: float) -> Array | None:
        """See `Perception.true_origin_m`."""
        return self._truth_m(now_s)
