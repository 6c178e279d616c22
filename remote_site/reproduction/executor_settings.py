"""ExecutorSettings, the parameters of an execution; Control and Path, the results of the executor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidConfiguration

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ExecutorSettings:
    """Parameters of an execution.

    Args:
        dt_s: Control period [s].
        horizon_s: Prediction horizon, N_p control periods [s].
        bandwidth_rad_s: Bandwidth of the closed loop; sets the control cost R; raised where components are
            short [rad/s].
        control_horizon_s: N_c control periods [s]; the prediction horizon when not given.
        max_acceleration_m_s2: Limit of the acceleration [m/s^2]; unlimited when not given.
        max_speed_m_s: Limit of the speed [m/s]; unlimited when not given.
        max_angular_acceleration_rad_s2: The same for the rotation of poses [rad/s^2].
        max_angular_speed_rad_s: The same for the rotation of poses [rad/s].
        pace: Speed of the motion as a share of the demonstrated speed; at most 1. A lower pace slows the
            reference and lowers the speed limits, while the task frames are followed as closely.

    Raises:
        InvalidConfiguration: When a number is not positive, the horizons do not fit or the pace is above 1.
    """

    dt_s: float = 0.02
    horizon_s: float = 1.2
    bandwidth_rad_s: float = 5.0
    control_horizon_s: float | None = None
    max_acceleration_m_s2: float | None = None
    max_speed_m_s: float | None = None
    max_angular_acceleration_rad_s2: float | None = None
    max_angular_speed_rad_s: float | None = None
    pace: float = 1.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InvalidConfiguration("executor", name, f"a positive number, got {value}")
        if not 1 <= self.n_controls <= self.n_steps:
            raise InvalidConfiguration("executor", "control_horizon_s", "from dt_s to horizon_s")
        if self.pace > 1.0:
            raise InvalidConfiguration("executor", "pace", f"at most 1, got {self.pace}")

    @property
    def n_steps(self) -> int:
        """Prediction horizon N_p."""
        return round(self.horizon_s / self.dt_s)

    @property
    def n_controls(self) -> int:
        """Control horizon N_c."""
        return self.n_steps if self.control_horizon_s is None else round(self.control_horizon_s / self.dt_s)

    def limited(self, acceleration: Array, velocity: Array, n_dims: int) -> Array:
        """Limit a commanded acceleration to the limits of speed and acceleration. Shape (T,).

        Args:
            acceleration: The command. Shape (T,).
            velocity: Velocity of the robot. Shape (T,).
            n_dims: How many of the T numbers belong to the position; the others belong to the rotation.
        """
        linear = (self.max_speed_m_s, self.max_acceleration_m_s2)
        angular = (self.max_angular_speed_rad_s, self.max_angular_acceleration_rad_s2)
        return np.concatenate(
            [
                self._bounded(acceleration[:n_dims], velocity[:n_dims], *linear),
                self._bounded(acceleration[n_dims:], velocity[n_dims:], *angular),
            ]
        )

    def paced(self, acceleration: Array, relative: Array, n_dims: int) -> Array:
        """Limit an acceleration to the pace's share of the speed limits, relative to the frames. Shape (T,).

        Args:
            acceleration: The command. Shape (T,).
            relative: Velocity of the robot relative to the frames. Shape (T,).
            n_dims: How many of the T numbers belong to the position.
        """
        if self.pace == 1.0:
            return acceleration
        linear, angular = (
            None if limit is None else self.pace * limit
            for limit in (self.max_speed_m_s, self.max_angular_speed_rad_s)
        )
        return np.concatenate(
            [
                self._bounded(acceleration[:n_dims], relative[:n_dims], linear, None),
                self._bounded(acceleration[n_dims:], relative[n_dims:], angular, None),
            ]
        )

    def _bounded(self, u: Array, velocity: Array, max_speed: float | None, most: float | None) -> Array:
        if max_speed is not None:
            following = velocity + self.dt_s * u
            speed = float(np.linalg.norm(following))
            if speed > max_speed:
                u = (following * (max_speed / speed) - velocity) / self.dt_s
        if most is not None:
            u = u * min(1.0, most / max(float(np.linalg.norm(u)), 1e-12))
        return u


@dataclass(frozen=True)
class Control:
    """Decision of one tick.

    Args:
        acceleration: Commanded acceleration in the world [m/s^2, rad/s^2]. Shape (T,).
        component: Present component among the learned ones; -1 on a way.
        way: Number of the way that the motion took where it began, -1 for none.
        elapsed_s: Time since the component was entered [s].
        arrived: True once the motion has ended.
        remaining_s: Demonstrated time to the end of the motion [s].
        desired: Desired point in the world, one control period ahead. Shape (C,).
    """

    acceleration: Array
    component: int
    way: int
    elapsed_s: float
    arrived: bool
    remaining_s: float
    desired: Array


@dataclass(frozen=True)
class Path:
    """Predicted motion.

    Args:
        points_local: Points in the last task frame. Shape (N, C).
        points_world: The same points in the world, with the frame as it was at the prediction. Shape (N,
            C).
        step_s: Time between points [s]; the last point may come earlier.
        done: True if the motion ends within the path.
    """

    points_local: Array
    points_world: Array
    step_s: float
    done: bool
