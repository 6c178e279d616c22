"""Executor: learned model, present task frames and robot state in, acceleration out (Sec. III-B).

At every tick: the Gaussian product for the present frames (Eqs. 8-9), the progress along the chain of
components, the reference over the horizon, the MPC (Eqs. 2-7). The robot moves relative to the task
frames; their own velocity and acceleration are estimated and fed forward.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from common.errors import InvalidConfiguration, InvalidInput
from common.gaussian_product import check_frames
from common.task_frame import TaskFrame
from common.tphsmm import TPHSMM
from remote_site.reproduction.frame_motion import FrameMotion
from remote_site.reproduction.mpc import solve
from remote_site.reproduction.progress import Progress, ProgressTracker
from remote_site.reproduction.reference import reference
from remote_site.reproduction.world_components import WorldComponents, start_shift

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ExecutorSettings:
    """How a model is executed.

    Args:
        dt_s: Control period [s].
        horizon_s: Prediction horizon, N_p control periods [s].
        bandwidth_rad_s: Of the closed loop; sets the control cost R [rad/s].
        control_horizon_s: N_c control periods [s]; the prediction horizon when not given.
        max_acceleration_m_s2: Limit of the acceleration [m/s^2]; none when not given.
        max_speed_m_s: Limit of the speed [m/s]; none when not given.

    Raises:
        InvalidConfiguration: When a number is not positive or the horizons do not fit.
    """

    dt_s: float = 0.02
    horizon_s: float = 1.2
    bandwidth_rad_s: float = 5.0
    control_horizon_s: float | None = None
    max_acceleration_m_s2: float | None = None
    max_speed_m_s: float | None = None

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InvalidConfiguration("executor", name, f"a positive number, got {value}")
        if not 1 <= self.n_controls <= self.n_steps:
            raise InvalidConfiguration("executor", "control_horizon_s", "from dt_s to horizon_s")

    @property
    def n_steps(self) -> int:
        """Prediction horizon N_p."""
        return round(self.horizon_s / self.dt_s)

    @property
    def n_controls(self) -> int:
        """Control horizon N_c."""
        return self.n_steps if self.control_horizon_s is None else round(self.control_horizon_s / self.dt_s)


@dataclass(frozen=True)
class Control:
    """What one tick decided.

    Args:
        acceleration: Command in the world [m/s^2]. Shape (D,).
        component: Present component.
        elapsed_s: Time since it was entered [s].
        arrived: Whether the motion has come to its end.
        remaining_s: Time to its end as it was demonstrated [s].
        desired: Desired position in the world, one control period ahead [m]. Shape (D,).
    """

    acceleration: Array
    component: int
    elapsed_s: float
    arrived: bool
    remaining_s: float
    desired: Array


@dataclass(frozen=True)
class Path:
    """A predicted motion.

    Args:
        points_local: Positions in the last task frame [m]. Shape (N, D).
        points_world: The same in the world, with the frame as it was at the prediction [m]. Shape (N, D).
        step_s: Time between points [s]; the last one may be earlier.
        done: Whether the motion comes to its end within the path.
    """

    points_local: Array
    points_world: Array
    step_s: float
    done: bool


@dataclass(frozen=True, eq=False)
class ExecutorState:
    """All that an execution remembers between ticks; immutable, so that a worker may continue from it.

    Args:
        progress: Where it is in the chain of components.
        motion: How the task frames move.
        start: Where the motion began in each frame [m], if demonstrations began there. Shape (P, D).
    """

    progress: Progress
    motion: FrameMotion
    start: Array | None


class Executor:
    """Executes one model; call `begin`, then `step` every control period.

    Args:
        model: The learned task.
        settings: How to execute it.

    Raises:
        InvalidModel: When no component is terminal.
    """

    def __init__(self, model: TPHSMM, settings: ExecutorSettings):
        self.model, self.settings = model, settings
        self._tracker = ProgressTracker(model)
        self._control_cost = _control_cost(model, settings.bandwidth_rad_s)
        self._state: ExecutorState | None = None
        self._shift = start_shift(model, None)
        self._world: WorldComponents | None = None

    @classmethod
    def from_state(cls, model: TPHSMM, settings: ExecutorSettings, state: ExecutorState) -> Executor:
        """An executor that continues from another's state."""
        executor = cls(model, settings)
        executor._continue(state)
        return executor

    def state(self) -> ExecutorState:
        """What the execution remembers now.

        Raises:
            InvalidInput: Before `begin`.
        """
        if self._state is None:
            raise InvalidInput("executor", "", "begin before anything else")
        return self._state

    @property
    def remaining_s(self) -> float:
        """Time until the end of the motion as it was demonstrated [s]."""
        return self._tracker.time_to_go(self.state().progress)

    def begin(self, position: Array, velocity: Array, frames: Sequence[TaskFrame]) -> None:
        """Begin the motion from where the robot is.

        Raises:
            InvalidInput: When shapes are not the model's or a number is not finite.
        """
        self._check(position, velocity, frames)
        position = np.asarray(position, dtype=float)
        world = WorldComponents.seen(self.model, start_shift(self.model, None), tuple(frames))
        progress = self._tracker.start(position, world.gaussians)
        start = np.stack([frame.to_local(position) for frame in frames]) if progress.from_start else None
        self._continue(ExecutorState(progress, FrameMotion.still(frames), start))

    def _continue(self, state: ExecutorState) -> None:
        self._state, self._world = state, None
        self._tracker = ProgressTracker(self.model, state.start)
        self._shift = start_shift(self.model, state.start)

    def step(self, position: Array, velocity: Array, frames: Sequence[TaskFrame]) -> Control:
        """One control period.

        Args:
            position: Of the robot in the world [m]. Shape (D,).
            velocity: Of the robot in the world [m/s]. Shape (D,).
            frames: The task frames now. Length P.

        Raises:
            InvalidInput: Before `begin`, or when the input is malformed; nothing was changed.
        """
        state, dt = self.state(), self.settings.dt_s
        self._check(position, velocity, frames)
        position, velocity = np.asarray(position, dtype=float), np.asarray(velocity, dtype=float)
        motion = state.motion.updated(frames, dt)
        world = self._see(tuple(frames))
        weights = world.weights(state.progress.component)
        relative = velocity - motion.velocity_at(position, weights)
        progress = self._tracker.advance(state.progress, position, relative, world.gaussians, dt)
        _, targets, costs = reference(
            progress.component,
            progress.elapsed_s,
            progress.waiting,
            self._tracker.successors,
            self._tracker.durations_s,
            world.entries,
            world.exits,
            world.precisions,
            self.settings.n_steps,
            dt,
        )
        u = solve(position, relative, targets, costs, self._control_cost, self.settings.n_controls, dt)[0]
        u = u + motion.acceleration_at(position, relative, weights)
        self._state = ExecutorState(progress, motion, state.start)
        return Control(
            acceleration=self._limited(u, velocity),
            component=progress.component,
            elapsed_s=progress.elapsed_s,
            arrived=progress.arrived,
            remaining_s=self._tracker.time_to_go(progress),
            desired=targets[0],
        )

    def predict(
        self,
        position: Array,
        velocity: Array,
        frames: Sequence[TaskFrame],
        step_s: float = 0.1,
        max_points: int = 200,
    ) -> Path:
        """Roll the whole remaining motion out in a copy, relative to the frames; changes nothing here.

        Args:
            position: Of the robot in the world [m]. Shape (D,).
            velocity: Of the robot in the world [m/s]. Shape (D,).
            frames: The task frames now. Length P.
            step_s: Time between the points of the path [s].
            max_points: The path is cut after so many.
        """
        state, dt = self.state(), self.settings.dt_s
        self._check(position, velocity, frames)
        p = np.asarray(position, dtype=float)
        weights = self._see(tuple(frames)).weights(state.progress.component)
        v = np.asarray(velocity, dtype=float) - state.motion.velocity_at(p, weights)
        still = replace(state, motion=FrameMotion.still(frames))
        copy = Executor.from_state(self.model, self.settings, still)
        points, every, done = [p], max(1, round(step_s / dt)), state.progress.arrived
        while not done and len(points) < max_points:
            for _ in range(every):
                control = copy.step(p, v, frames)
                u, done = control.acceleration, control.arrived
                p, v = p + dt * v + 0.5 * dt**2 * u, v + dt * u  # Eq. 2
                if done:
                    break
            points.append(p)
        world = np.stack(points)
        return Path(frames[-1].to_local(world), world, every * dt, done)

    def _see(self, frames: tuple[TaskFrame, ...]) -> WorldComponents:
        """The components in the world; computed again only when the frames moved."""
        if self._world is None or not self._world.valid_for(frames):
            self._world = WorldComponents.seen(self.model, self._shift, frames)
        return self._world

    def _limited(self, u: Array, velocity: Array) -> Array:
        """The command within the limits of speed and acceleration."""
        s = self.settings
        if s.max_speed_m_s is not None:
            following = velocity + s.dt_s * u
            speed = float(np.linalg.norm(following))
            if speed > s.max_speed_m_s:
                u = (following * (s.max_speed_m_s / speed) - velocity) / s.dt_s
        if s.max_acceleration_m_s2 is not None:
            u = u * min(1.0, s.max_acceleration_m_s2 / max(float(np.linalg.norm(u)), 1e-12))
        return u

    def _check(self, position: Array, velocity: Array, frames: Sequence[TaskFrame]) -> None:
        check_frames(frames, self.model.n_frames, self.model.n_dims)
        for name, value in (("position", position), ("velocity", velocity)):
            value = np.asarray(value, dtype=float)
            if value.shape != (self.model.n_dims,) or not np.isfinite(value).all():
                raise InvalidInput("executor", name, f"{self.model.n_dims} finite numbers, got {value}")


def _control_cost(model: TPHSMM, bandwidth_rad_s: float) -> float:
    """R from a bandwidth: the median over the components of their middle precision, over bandwidth^4."""
    variances = np.median(np.linalg.eigvalsh(model.residual_covariances), axis=-1)
    return float(np.median(1.0 / variances)) / bandwidth_rad_s**4


def warm_up(n_dims: int) -> None:
    """Compile the kernels of the control loop for dimension D, so that the first tick is not late."""
    one, eye = np.zeros((2, n_dims)), np.broadcast_to(np.eye(n_dims), (2, n_dims, n_dims)).copy()
    _, targets, costs = reference(0, 0.0, False, np.array([1, -1]), np.ones(2), one, one, eye, 2, 0.1)
    solve(np.zeros(n_dims), np.zeros(n_dims), targets, costs, 1.0, 2, 0.1)
