"""Motion of the task frames: velocity and acceleration estimated from successive frames.

The controller's plant is a double integrator in the world. To follow a moving frame it must know the frame's
velocity, and to follow it without lag its acceleration, which is fed forward.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.kernel import kernel
from farhand.common.model.task_frame import FrameArrays

Array = NDArray[np.float64]

# Bandwidth of the estimate: what moves faster is taken for noise.
_BANDWIDTH_RAD_S = 15.0
# A frame that moved faster than this between two ticks was put elsewhere; that is no velocity.
_JUMP_M_S = 1.0


class FrameMotion(NamedTuple):
    """Estimated motion of the P frames."""

    frames: FrameArrays  # as last seen
    origin: Array  # filtered origin [m], shape (P, D)
    velocity: Array  # [m/s], shape (P, D)
    acceleration: Array  # [m/s^2], shape (P, D)
    spin: Array  # skew matrix of the angular velocity [rad/s], shape (P, D, D)

    @classmethod
    def still(cls, frames: FrameArrays) -> FrameMotion:
        """Return the motion of frames that are seen for the first time."""
        zeros = np.zeros_like(frames.b)
        return cls(frames, frames.b, zeros, zeros.copy(), np.zeros_like(frames.A))

    def updated(self, frames: FrameArrays, dt: float) -> FrameMotion:
        """Return the estimate after the next frames (fading-memory filter of third order)."""
        return FrameMotion(frames, *_updated(self, frames, dt))

    def velocity_at(self, point: Array, weights: Array) -> Array:
        """Return the velocity of the weighted frames at a position or pose [m/s, rad/s]. Shape (T,).

        Args:
            point: In the world. Shape (C,).
            weights: Share of each frame. Shape (P, T, T).
        """
        return _velocity_at(self, point, weights)

    def acceleration_at(self, point: Array, relative_velocity: Array, weights: Array) -> Array:
        """Return the acceleration that keeps a motion relative to the frames unchanged. Shape (T,).

        It is the origin's acceleration plus the Coriolis and centripetal parts of the rotation; for an
        orientation, that of the frame's rotation in the axes of a rotating body.
        """
        return _acceleration_at(self, point, relative_velocity, weights)


@kernel
def _velocity_at(motion, point, weights):
    P, D = motion.origin.shape
    T = weights.shape[1]
    total, own = np.zeros(T), np.empty(T)
    for j in range(P):
        for a in range(D):
            own[a] = motion.velocity[j, a]
            for c in range(D):
                own[a] += motion.spin[j, a, c] * (point[c] - motion.frames.b[j, c])
        if T > D:
            _rotation_in_body(motion.spin[j], point[D:], own[D:])
        _add_share(weights[j], own, total)
    return total


@kernel
def _acceleration_at(motion, point, relative, weights):
    P, D = motion.origin.shape
    T = weights.shape[1]
    total, own, inner = np.zeros(T), np.empty(T), np.empty(D)
    for j in range(P):
        for a in range(D):
            inner[a] = 2.0 * relative[a]
            for c in range(D):
                inner[a] += motion.spin[j, a, c] * (point[c] - motion.frames.b[j, c])
        for a in range(D):
            own[a] = motion.acceleration[j, a]
            for c in range(D):
                own[a] += motion.spin[j, a, c] * inner[c]
        if T > D:  # d/dt R^T w = -w_relative x R^T w
            _rotation_in_body(motion.spin[j], point[D:], inner)
            x, y, z = relative[D], relative[D + 1], relative[D + 2]
            own[D] = z * inner[1] - y * inner[2]
            own[D + 1] = x * inner[2] - z * inner[0]
            own[D + 2] = y * inner[0] - x * inner[1]
        _add_share(weights[j], own, total)
    return total


@kernel
def _add_share(weight, own, total):
    for a in range(total.size):
        for c in range(total.size):
            total[a] += weight[a, c] * own[c]


@kernel
def _rotation_in_body(spin, quat, out):
    """Write R^T w to out, for the rotation w of a skew matrix and the orientation R of a quaternion."""
    w, x, y, z = quat[0], -quat[1], -quat[2], -quat[3]
    a, b, c = spin[2, 1], spin[0, 2], spin[1, 0]
    i, j, k = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    out[0] = a + w * i + y * k - z * j
    out[1] = b + w * j + z * i - x * k
    out[2] = c + w * k + x * j - y * i


@kernel
def _updated(motion, frames, dt):
    """Return origin, velocity, acceleration and spin after the next frames."""
    theta = np.exp(-_BANDWIDTH_RAD_S * dt)
    origin, velocity, acceleration = motion.origin.copy(), motion.velocity.copy(), motion.acceleration.copy()
    spin = motion.spin.copy()
    P, D = origin.shape
    for j in range(P):
        moved = 0.0
        for k in range(D):
            origin[j, k] += dt * velocity[j, k] + 0.5 * dt**2 * acceleration[j, k]
            velocity[j, k] += dt * acceleration[j, k]
            moved += (frames.b[j, k] - motion.frames.b[j, k]) ** 2
        if np.sqrt(moved) > _JUMP_M_S * dt:
            origin[j] = frames.b[j]
            continue
        for k in range(D):
            e = frames.b[j, k] - origin[j, k]
            origin[j, k] += (1 - theta**3) * e
            velocity[j, k] += 1.5 * (1 - theta) ** 2 * (1 + theta) * e / dt
            acceleration[j, k] += (1 - theta) ** 3 * e / dt**2
        for a in range(D):
            for c in range(D):
                skew = 0.0  # of the turn A_new A_old^T
                for m in range(D):
                    skew += 0.5 * frames.A[j, a, m] * motion.frames.A[j, c, m]
                    skew -= 0.5 * frames.A[j, c, m] * motion.frames.A[j, a, m]
                spin[j, a, c] = theta * spin[j, a, c] + (1 - theta) * skew / dt
    return origin, velocity, acceleration, spin
