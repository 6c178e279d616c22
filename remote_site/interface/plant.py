"""Plant: interface of four methods to the moving machine; with `PointPlant`, the paper's point of unit mass."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput
from farhand.common.model.manifold import Manifold

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EffectorState:
    """State of the end effector: a position, or a pose (see `farhand.common.model.manifold`).

    Args:
        point: Position or pose in the world. Shape (C,).
        velocity: Velocity, a tangent at the point [m/s, rad/s]. Shape (T,).
        load: Force, and with a pose the torque about it, on the tool, mean over the last 10 ms [N, Nm].
            Shape (T,); None if it is not measured.
        setpoint: Point and velocity of the virtual body that accelerations move and the effector follows;
            None if accelerations move the effector itself.
        carried: Velocity of a moving body that the effector touches, a tangent at the setpoint [m/s, rad/s]. Shape
            (T,). None in free space.
        joints_rad: Joint angles of an arm [rad]; None without joints.
    """

    point: Array
    velocity: Array
    load: Array | None = None
    setpoint: tuple[Array, Array] | None = None
    carried: Array | None = None
    joints_rad: Array | None = None

    @property
    def n_dims(self) -> int:
        """Dimension D of positions."""
        return Manifold.of(self.point.size, self.velocity.size).n_dims

    @property
    def position_m(self) -> Array:
        """Position. Shape (D,) [m]."""
        return self.point[: self.n_dims]

    @property
    def velocity_m_s(self) -> Array:
        """Velocity. Shape (D,) [m/s]."""
        return self.velocity[: self.n_dims]

    @property
    def force_n(self) -> Array | None:
        """Force on the tool. Shape (D,) [N]; None if it is not measured."""
        return None if self.load is None else self.load[: self.n_dims]

    @property
    def contact_n(self) -> float | None:
        """Magnitude of the force on the tool [N]; None if it is not measured."""
        force = self.force_n
        return None if force is None else math.sqrt(force @ force)

    @property
    def controlled(self) -> tuple[Array, Array]:
        """Point and velocity to plan accelerations from. Shapes (C,) and (T,)."""
        return (self.point, self.velocity) if self.setpoint is None else self.setpoint

    @property
    def own_speed_m_s(self) -> float:
        """Speed of the effector relative to the body that carries it [m/s]."""
        if self.carried is None:
            return float(np.linalg.norm(self.velocity_m_s))
        return float(np.linalg.norm((self.controlled[1] - self.carried)[: self.n_dims]))

    @property
    def is_plausible(self) -> bool:
        """True if every number is one that may be measured, see `are_plausible`."""
        measured = (self.point, self.velocity, self.load, self.joints_rad)
        return all(are_plausible(vector) for vector in measured if vector is not None)


MOST_MEASURED = 1e6
"""Largest magnitude of a measured number. A report carries no larger one: nobody could read it."""


def are_plausible(numbers: Array) -> bool:
    """Decide whether numbers are finite and no larger than `MOST_MEASURED`."""
    return bool((np.abs(numbers) <= MOST_MEASURED).all())


def check_state(state: EffectorState, n_coordinates: int, n_tangent: int) -> None:
    """Check what a plant's `read` returned, in form.

    Args:
        state: State of the effector.
        n_coordinates: Numbers C of a point.
        n_tangent: Numbers T of a tangent.

    Raises:
        InvalidInput: When it is no `EffectorState`, or one of its vectors has another shape.
    """
    if not isinstance(state, EffectorState):
        raise InvalidInput("plant", "read", f"an EffectorState, got {type(state).__name__}")
    for name, vector, n in (
        ("point", state.point, n_coordinates),
        ("velocity", state.velocity, n_tangent),
        ("load", state.load, n_tangent),
    ):
        if getattr(vector, "shape", None) != (n,) and not (name == "load" and vector is None):
            found = f"shape {vector.shape}" if isinstance(vector, np.ndarray) else type(vector).__name__
            raise InvalidInput("plant", f"read: {name}", f"an array of shape ({n},), got {found}")


class Plant(Protocol):
    """Interface of a robot's machine; your own machine needs one class with these four methods.

    It moves a position or a pose: its points have C coordinates, its tangents T numbers. It keeps the limits of its
    task whatever it is told. What it may have besides: `Startable`, `Closable`, `Haltable`, `Monitored`.
    """

    def read(self) -> EffectorState:
        """Measure and return the effector's state."""
        ...

    def accelerate(self, acceleration: Array, dt_s: float) -> None:
        """Move under an acceleration (T,) [m/s^2, rad/s^2] for one control period (AUTONOMOUS)."""
        ...

    def follow(self, point: Array, max_speed_m_s: float, dt_s: float) -> None:
        """Move towards a point (C,) for one control period, never faster than the limit (DIRECT)."""
        ...

    def brake(self, dt_s: float) -> None:
        """Come to rest within the limits and hold that position (all other modes)."""
        ...


class PointPlant:
    """Point of unit mass in a box, driven by force: the double integrator of Eq. 2, exact.

    Args:
        start_m: First position. Shape (D,) [m].
        workspace_m: Edges of the box, which begins at the origin. Shape (D,) [m].
        max_speed_m_s: Limit in every mode [m/s].
        max_acceleration_m_s2: Limit in every mode [m/s^2].
    """

    _FOLLOW_GAIN_1_S = 12.0

    def __init__(
        self, start_m: Array, workspace_m: Array, max_speed_m_s: float, max_acceleration_m_s2: float
    ):
        self._position = np.array(start_m, dtype=float)
        self._velocity = np.zeros_like(self._position)
        self._workspace = np.array(workspace_m, dtype=float)
        self._max_speed = max_speed_m_s
        self._max_acceleration = max_acceleration_m_s2

    def read(self) -> EffectorState:
        """See `Plant.read`."""
        return EffectorState(self._position.copy(), self._velocity.copy())

    def accelerate(self, acceleration: Array, dt_s: float) -> None:
        """See `Plant.accelerate`."""
        self._move_with(self._velocity + _clipped(acceleration, self._max_acceleration) * dt_s, dt_s)

    def follow(self, point: Array, max_speed_m_s: float, dt_s: float) -> None:
        """See `Plant.follow`."""
        error = np.asarray(point, dtype=float) - self._position
        distance = float(np.linalg.norm(error))
        # At most the speed that still allows a stop at the goal.
        speed = min(self._FOLLOW_GAIN_1_S * distance, np.sqrt(1.6 * self._max_acceleration * distance))
        wanted = error / max(distance, 1e-12) * min(speed, max_speed_m_s, self._max_speed)
        self._approach_velocity(wanted, dt_s)

    def brake(self, dt_s: float) -> None:
        """See `Plant.brake`."""
        self._approach_velocity(np.zeros_like(self._velocity), dt_s)

    def _approach_velocity(self, wanted: Array, dt_s: float) -> None:
        change = _clipped(wanted - self._velocity, self._max_acceleration * dt_s)
        self._move_with(self._velocity + change, dt_s)

    def _move_with(self, velocity: Array, dt_s: float) -> None:
        """Change from the present velocity to another one at constant acceleration, inside the box."""
        velocity = _clipped(velocity, self._max_speed)
        reached = self._position + 0.5 * (self._velocity + velocity) * dt_s
        self._position = np.clip(reached, 0.0, self._workspace)
        self._velocity = np.where(self._position == reached, velocity, 0.0)


def _clipped(vector: Array, max_norm: float) -> Array:
    """Return a vector shortened to a norm, direction kept."""
    norm = float(np.linalg.norm(vector))
    return vector if norm <= max_norm else vector * (max_norm / norm)
