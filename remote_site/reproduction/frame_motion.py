"""How the task frames move: velocity and acceleration estimated from successive frames.

The controller's plant is a double integrator in the world. To follow a moving frame it must know the
frame's velocity, and to follow it without lag its acceleration, which is fed forward.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from common.task_frame import TaskFrame

Array = NDArray[np.float64]

# Bandwidth of the estimate: what moves faster is taken for noise.
_BANDWIDTH_RAD_S = 15.0
# A frame that moved faster than this between two ticks was put elsewhere; that is no velocity.
_JUMP_M_S = 1.0


class FrameMotion(NamedTuple):
    """Estimated motion of the P frames."""

    frames: tuple[TaskFrame, ...]  # as last seen
    origin: Array  # filtered origin [m], shape (P, D)
    velocity: Array  # [m/s], shape (P, D)
    acceleration: Array  # [m/s^2], shape (P, D)
    spin: Array  # skew matrix of the angular velocity [rad/s], shape (P, D, D)

    @classmethod
    def still(cls, frames: Sequence[TaskFrame]) -> FrameMotion:
        """Frames that are seen for the first time."""
        origin = np.stack([frame.b for frame in frames])
        zeros = np.zeros_like(origin)
        return cls(tuple(frames), origin, zeros, zeros, np.zeros((*origin.shape, origin.shape[1])))

    def updated(self, frames: Sequence[TaskFrame], dt: float) -> FrameMotion:
        """The estimate after the next frames (fading-memory filter of third order)."""
        theta = np.exp(-_BANDWIDTH_RAD_S * dt)
        seen = np.stack([frame.b for frame in frames])
        step = seen - np.stack([frame.b for frame in self.frames])
        jumped = np.linalg.norm(step, axis=1, keepdims=True) > _JUMP_M_S * dt
        predicted = self.origin + dt * self.velocity + 0.5 * dt**2 * self.acceleration
        e = np.where(jumped, 0.0, seen - predicted)
        predicted = np.where(jumped, seen, predicted)
        turns = np.stack([new.A @ old.A.T for new, old in zip(frames, self.frames, strict=True)])
        spin = 0.5 * (turns - np.swapaxes(turns, -1, -2)) / dt
        spin = np.where(jumped[..., None], self.spin, theta * self.spin + (1 - theta) * spin)
        return FrameMotion(
            tuple(frames),
            predicted + (1 - theta**3) * e,
            self.velocity + dt * self.acceleration + 1.5 * (1 - theta) ** 2 * (1 + theta) * e / dt,
            self.acceleration + (1 - theta) ** 3 * e / dt**2,
            spin,
        )

    def velocity_at(self, point: Array, weights: Array) -> Array:
        """Velocity of the weighted frames where a position or pose is [m/s, rad/s]. Shape (T,).

        Args:
            point: In the world. Shape (C,).
            weights: Share of each frame. Shape (P, T, T).
        """
        return np.einsum("pde,pe->d", weights, self._velocities(point, weights.shape[1]))

    def acceleration_at(self, point: Array, relative_velocity: Array, weights: Array) -> Array:
        """Acceleration that keeps a motion relative to the frames unchanged. Shape (T,).

        That of the origin, and the Coriolis and centripetal parts of the rotation; of an orientation, that
        of the frame's rotation in the axes of a body that turns.
        """
        n_dims = self.origin.shape[1]
        inner = 2.0 * relative_velocity[:n_dims] + np.einsum("pde,pe->pd", self.spin, self._arms(point))
        accelerations = self.acceleration + np.einsum("pde,pe->pd", self.spin, inner)
        if weights.shape[1] > n_dims:
            turning = self._velocities(point, weights.shape[1])[:, n_dims:]
            turns = -np.cross(relative_velocity[n_dims:], turning)
            accelerations = np.concatenate([accelerations, turns], axis=1)
        return np.einsum("pde,pe->d", weights, accelerations)

    def _arms(self, point: Array) -> Array:
        return point[: self.origin.shape[1]] - np.stack([frame.b for frame in self.frames])

    def _velocities(self, point: Array, n_tangent: int) -> Array:
        """Velocity of the point of each frame that is there, and its rotation in body axes. Shape (P, T)."""
        velocities = self.velocity + np.einsum("pde,pe->pd", self.spin, self._arms(point))
        if n_tangent == velocities.shape[1]:
            return velocities
        world = np.stack([self.spin[:, 2, 1], self.spin[:, 0, 2], self.spin[:, 1, 0]], axis=1)
        body = world @ Rotation.from_quat(point[3:], scalar_first=True).as_matrix()  # R^T w
        return np.concatenate([velocities, body], axis=1)
