"""Execution of a model on the point plant while its target and the robot are disturbed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.remote_site.reproduction.executor import Executor, ExecutorSettings

Array = NDArray[np.float64]

# Limits of the robot in all studies.
SETTINGS = ExecutorSettings(max_acceleration_m_s2=4.0, max_speed_m_s=0.6)

# An execution that takes this much longer than what remains of the demonstrated motion has stalled.
_PATIENCE, _PATIENCE_S = 3.0, 8.0


class Disturbance:
    """Disturbance of an execution. By default there is none."""

    def __init__(self, frame: TaskFrame):
        self._frame = frame

    def frame(self, time_s: float, position: Array) -> TaskFrame:
        """Return the receptacle at a time, when the robot is at a position [m]."""
        del time_s, position
        return self._frame

    def robot(
        self, time_s: float, position: Array, velocity: Array, following: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        """Return where the robot really moves in one period.

        Args:
            time_s: Time at the beginning of the period [s].
            position: Position at its beginning [m]. Shape (3,).
            velocity: Velocity at its beginning [m/s]. Shape (3,).
            following: Position and velocity at its end, if nothing happens.
        """
        del time_s, position, velocity
        return following


@dataclass(frozen=True, eq=False)
class PointExecution:
    """Record of an execution.

    Args:
        time_s: Shape (T,) [s].
        world: Positions of the robot [m]. Shape (T, D).
        local: The same positions in the receptacle's frame at their times [m]. Shape (T, D).
        turn_deg: Angle between the tool and the receptacle; zeros for a model of positions. Shape (T,).
        arrived: True if the motion reached its end, False if it was given up.
    """

    time_s: Array
    world: Array
    local: Array
    turn_deg: Array
    arrived: bool


def execute(
    model: TPHSMM,
    start: Array,
    event: Disturbance,
    settings: ExecutorSettings = SETTINGS,
    seen: Callable[[list[TaskFrame]], TaskFrame] = lambda frames: frames[-1],
    rest_s: float = 0.0,
) -> PointExecution:
    """Execute a model with one frame from rest.

    Args:
        model: The learned task.
        start: First point in the world, at rest: a position or a pose. Shape (C,).
        event: Disturbance.
        settings: Settings of the executor.
        seen: Selects the frame that the controller gets from the frames so far (the last is the present
            one); the true one by default.
        rest_s: Time for which it continues after the arrival [s].
    """
    dt, space = settings.dt_s, model.manifold
    D = space.n_dims
    executor = Executor(model, settings)
    p, v, t = space.checked(start, "execution", "start"), np.zeros(space.n_tangent), 0.0
    frames, points = [event.frame(t, p[:D])], [p]
    executor.begin(p, v, [seen(frames)])
    give_up_s = _PATIENCE * executor.remaining_s + _PATIENCE_S
    arrived_s = np.inf
    while t < min(arrived_s + rest_s, give_up_s):
        control = executor.step(p, v, [seen(frames)])
        u = control.acceleration
        following, v_following = space.exp(p, dt * v + 0.5 * dt**2 * u), v + dt * u  # Eq. 2
        moved = event.robot(t, p[:D], v[:D], (following[:D], v_following[:D]))
        p, v = np.concatenate([moved[0], following[D:]]), np.concatenate([moved[1], v_following[D:]])
        t = dt * len(points)
        arrived_s = min(arrived_s, t) if control.arrived else arrived_s
        frames.append(event.frame(t, p[:D]))
        points.append(p)
    local = np.stack([frame.to_local(point) for frame, point in zip(frames, points, strict=True)])
    turn = 2.0 * np.arccos(np.clip(np.abs(local[:, D]), 0.0, 1.0)) if space.oriented else np.zeros(len(local))
    return PointExecution(
        np.arange(len(points), dtype=float) * dt,
        np.stack(points)[:, :D],
        local[:, :D],
        np.degrees(turn),
        bool(np.isfinite(arrived_s)),
    )
