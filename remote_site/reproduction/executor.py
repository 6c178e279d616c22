"""Executor: computes an acceleration from model, task frames and the robot's state (Sec. III-B).

Each tick computes the Gaussian product for the present frames (Eqs. 8-9), the progress along the chain of
components, the reference over the horizon, and the MPC (Eqs. 2-7). The robot moves relative to the task
frames; the frames' own velocity and acceleration are estimated and fed forward.

A point is a position (D,), or a pose (x, y, z, qw, qx, qy, qz); velocities and accelerations are tangents
(see `farhand.common.model.manifold`): for a pose [m/s, in the axes of the world] and [rad/s, in the axes of
the body].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput
from farhand.common.model.gaussian_product import check_frames
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.remote_site.reproduction.chains import chosen, with_way
from farhand.remote_site.reproduction.executor_settings import Control, ExecutorSettings, Path
from farhand.remote_site.reproduction.frame_motion import FrameMotion
from farhand.remote_site.reproduction.mpc import solve
from farhand.remote_site.reproduction.progress import Progress, ProgressTracker
from farhand.remote_site.reproduction.reference import reference, seen_from
from farhand.remote_site.reproduction.world_components import LocalComponents, WorldComponents

Array = NDArray[np.float64]

# Phase that the closed loop covers in the components' median duration; with less it would cut corners [rad].
_LEAST_BANDWIDTH_RAD = 5.0


@dataclass(frozen=True, eq=False)
class ExecutorState:
    """Complete state of an execution between ticks; immutable, so that a worker may continue from it.

    Args:
        progress: Position in the chain of components.
        motion: Motion of the task frames.
        start: Start of the motion in each frame, if a way applies there or demonstrations began there. It
            alone decides which way is taken. Shape (P, C).
    """

    progress: Progress
    motion: FrameMotion
    start: Array | None


class Executor:
    """Execution of one model: call `begin`, then `step` in every control period.

    Args:
        model: The learned task.
        settings: Settings of the execution.

    Raises:
        InvalidModel: When no component is terminal.
    """

    def __init__(self, model: TPHSMM, settings: ExecutorSettings):
        self.model, self.settings = model, settings
        self.way = -1
        """Number of the way that is taken, -1 for none."""
        self._tracker = ProgressTracker(model)
        self._control_cost = _control_cost(model, settings.bandwidth_rad_s)
        self._state: ExecutorState | None = None
        self._local = LocalComponents.of(model)
        self._world: WorldComponents | None = None
        self._ahead: dict[int, NDArray[np.int64]] = {}
        self._seen_for = -1

    @classmethod
    def from_state(cls, model: TPHSMM, settings: ExecutorSettings, state: ExecutorState) -> Executor:
        """Return an executor that continues from another one's state."""
        executor = cls(model, settings)
        executor._continue(state)
        return executor

    def state(self) -> ExecutorState:
        """Return the present state of the execution.

        Raises:
            InvalidInput: Before `begin`.
        """
        if self._state is None:
            raise InvalidInput("executor", "", "begin before anything else")
        return self._state

    @property
    def remaining_s(self) -> float:
        """Demonstrated time to the end of the motion, at the present pace [s]."""
        return self._tracker.time_to_go(self.state().progress) / self.settings.pace

    def begin(self, point: Array, velocity: Array, frames: Sequence[TaskFrame]) -> None:
        """Begin the motion from where the robot is.

        Raises:
            InvalidInput: When shapes are not the model's or a number is not finite.
        """
        point, _ = check_start(self.model, point, velocity, frames)
        world = LocalComponents.of(self.model).seen(frames)
        progress = ProgressTracker(self.model).start(point, world.gaussians)
        start = np.stack([frame.to_local(point) for frame in frames])
        if chosen(self.model, start) >= 0:
            progress = Progress(self.model.n_components, from_start=True)
        elif not progress.from_start:
            start = None
        self._continue(ExecutorState(progress, FrameMotion.still(world.frame_arrays), start))

    def resume(self, frames: Sequence[TaskFrame]) -> None:
        """Resume after a pause; the frames' motion is estimated from scratch.

        Raises:
            InvalidInput: Before `begin`, or when the frames are not the model's.
        """
        check_frames(frames, self.model.n_frames, self.model.n_dims)
        state = self.state()
        world = self._see(frames, state.progress.component)
        self._state = replace(state, motion=FrameMotion.still(world.frame_arrays))

    def _continue(self, state: ExecutorState) -> None:
        self._state, self._world = state, None
        model, self.way = self.model, -1
        if state.start is not None:
            self.way = chosen(model, state.start)
            model = with_way(model, model.ways[self.way], state.start) if self.way >= 0 else model
        self._tracker = ProgressTracker(model, state.start, self.model.n_components)
        self._local, self._ahead = LocalComponents.of(model), {}

    def step(self, point: Array, velocity: Array, frames: Sequence[TaskFrame]) -> Control:
        """Compute the control of one period.

        Args:
            point: Point of the robot in the world. Shape (C,).
            velocity: Velocity of the robot in the world [m/s, rad/s]. Shape (T,).
            frames: Present task frames. Length P.

        Raises:
            InvalidInput: Before `begin`, or when the input is malformed; nothing was changed.
        """
        state, dt, walked = self.state(), self.settings.dt_s, self.settings.dt_s * self.settings.pace
        point, velocity = check_start(self.model, point, velocity, frames)
        world = self._see(frames, state.progress.component)
        motion = state.motion.updated(world.frame_arrays, dt)
        weights = world.weights(state.progress.component)
        relative = velocity - motion.velocity_at(point, weights)
        progress = self._tracker.advance(state.progress, point, relative, world.gaussians, walked)
        _, targets, costs = reference(
            progress.component,
            progress.elapsed_s,
            progress.waiting,
            self._tracker.successors,
            self._tracker.durations_s,
            world.entries,
            world.ramps,
            world.precisions,
            self.settings.n_steps,
            walked,
        )
        tangents, costs = seen_from(point, targets, costs)
        here = np.zeros_like(relative)
        u = solve(here, relative, tangents, costs, self._control_cost, self.settings.n_controls, dt)[0]
        u = self.settings.paced(u, relative, self.model.n_dims)
        u = u + motion.acceleration_at(point, relative, weights)
        self._state = ExecutorState(progress, motion, state.start)
        return Control(
            acceleration=self.settings.limited(u, velocity, self.model.n_dims),
            component=progress.component if progress.component < self.model.n_components else -1,
            way=self.way,
            elapsed_s=progress.elapsed_s,
            arrived=progress.arrived,
            remaining_s=self._tracker.time_to_go(progress) / self.settings.pace,
            desired=targets[0],
        )

    def predict(
        self,
        point: Array,
        velocity: Array,
        frames: Sequence[TaskFrame],
        step_s: float = 0.1,
        max_points: int = 200,
    ) -> Path:
        """Roll out the whole remaining motion in a copy, relative to the frames.

        This executor stays unchanged.

        Args:
            point: Point of the robot in the world. Shape (C,).
            velocity: Velocity of the robot in the world [m/s, rad/s]. Shape (T,).
            frames: Present task frames. Length P.
            step_s: Time between the points of the path [s].
            max_points: Largest number of points; the path ends there.
        """
        state, dt = self.state(), self.settings.dt_s
        p, velocity = check_start(self.model, point, velocity, frames)
        world = self._see(frames, state.progress.component)
        weights = world.weights(state.progress.component)
        v = velocity - state.motion.velocity_at(p, weights)
        still = replace(state, motion=FrameMotion.still(world.frame_arrays))
        copy = Executor.from_state(self.model, self.settings, still)
        points, every, done = [p], max(1, round(step_s / dt)), state.progress.arrived
        while not done and len(points) < max_points:
            for _ in range(every):
                control = copy.step(p, v, frames)
                u, done = control.acceleration, control.arrived
                p, v = self.model.manifold.exp(p, dt * v + 0.5 * dt**2 * u), v + dt * u  # Eq. 2
                if done:
                    break
            points.append(p)
        path = np.stack(points)
        return Path(frames[-1].to_local(path), path, every * dt, done)

    def _see(self, frames: Sequence[TaskFrame], component: int) -> WorldComponents:
        """Return the components in the world that a tick needs; recompute them only when the frames moved."""
        if component not in self._ahead:
            self._ahead[component] = self._tracker.ahead(component, self.settings.horizon_s)
        if self._world is None or not self._world.valid_for(frames):
            self._world, self._seen_for = self._local.seen(frames, self._ahead[component]), component
        elif component != self._seen_for:
            self._world.gaussians.see(self._ahead[component])
            self._seen_for = component
        return self._world


def check_start(
    model: TPHSMM, point: Array, velocity: Array, frames: Sequence[TaskFrame]
) -> tuple[Array, Array]:
    """Check that a model can be executed from a state of the robot; return the state as arrays.

    Args:
        model: The learned task.
        point: Point of the robot in the world. Shape (C,).
        velocity: Its velocity, a tangent. Shape (T,).
        frames: The task frames.

    Raises:
        InvalidInput: When shapes are not the model's or a number is not finite.
    """
    space = model.manifold
    check_frames(frames, model.n_frames, space.n_dims)
    point, velocity = space.checked(point, "executor", "point"), np.asarray(velocity, dtype=float)
    if point.ndim != 1:
        raise InvalidInput("executor", "point", f"one point, got shape {point.shape}")
    if velocity.shape != (space.n_tangent,) or not np.isfinite(velocity).all():
        raise InvalidInput("executor", "velocity", f"{space.n_tangent} finite numbers, got {velocity}")
    return point, velocity


def _control_cost(model: TPHSMM, bandwidth_rad_s: float) -> tuple[float, ...]:
    """Return the diagonal of R: per part, the components' median precision over bandwidth^4. Length T."""
    space, moving = model.manifold, ~model.terminal
    duration_s = float(np.median(model.duration_mean_s[moving])) if moving.any() else 0.0
    if duration_s > 0.0:
        bandwidth_rad_s = max(bandwidth_rad_s, _LEAST_BANDWIDTH_RAD / duration_s)
    cost = np.empty(space.n_tangent)
    for part in space.parts:
        variances = np.median(np.linalg.eigvalsh(model.residual_covariances[..., part, part]), axis=-1)
        cost[part] = np.median(1.0 / variances) / bandwidth_rad_s**4
    return tuple(cost.tolist())
