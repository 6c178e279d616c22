"""Differential inverse kinematics: the joint velocities that come closest to a twist within all limits.

The quadratic program is that of ``mink.solve_ik`` with the same task and limits, to the last bit. Its
constant parts are assembled only once, and daqp is called directly: that takes half the time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm import arm
from farhand.common.arm.engine import daqp, mink
from farhand.common.arm.kinematics import Kinematics, moved
from farhand.common.arm.robot_model import geoms_of

Array = NDArray[np.float64]

# mink seeks a displacement, here over this time: joints approach their limits with this time constant.
_AHEAD_S = 0.1
# Weight of a radian in metres.
_POSITION_COST, _ORIENTATION_COST = 1.0, 0.3
_DAMPING = 1e-4
# Links approach each other and the panel at most with (distance - minimum) * gain / _AHEAD_S^2.
_CLEARANCE_M, _NEAR_M, _COLLISION_GAIN = 0.005, 0.08, 0.05
_TOLERANCE = 1e-8

# A redundant arm returns to its rest posture with this time constant, at most with this speed.
_HOMING_S, _HOMING_RAD_S = 1.0, 0.3


class Solution(NamedTuple):
    """Solution of the inverse kinematics.

    Args:
        joint_velocities: Shape (N,) [rad/s].
        missing_m_s: Velocity that the limits, or a singularity, took away from the twist [m/s].
        missing_rad_s: Angular velocity that they took away [rad/s].
    """

    joint_velocities: Array
    missing_m_s: float
    missing_rad_s: float


class VelocityIk:
    """Solver of one quadratic program per control period.

    Args:
        kinematics: Kinematics of the arm, up to date.
    """

    def __init__(self, kinematics: Kinematics):
        self._kinematics = kinematics
        model, robot = kinematics.model, kinematics.cell.robot
        self._home_rad = np.array(robot.home_rad)
        self.task = mink.FrameTask(arm.TIP, "site", _POSITION_COST, _ORIENTATION_COST)
        speeds = {
            name: np.array([speed])
            for name, speed in zip(arm.joint_names(robot), robot.limits.velocity_rad_s, strict=True)
        }
        self._ranges = mink.ConfigurationLimit(model)
        self._collisions = mink.CollisionAvoidanceLimit(
            model,
            [
                (geoms_of(robot, model, pair.these, arm.ARM), geoms_of(robot, model, pair.those, arm.ARM))
                for pair in robot.avoid
            ],
            gain=_COLLISION_GAIN,
            minimum_distance_from_collisions=_CLEARANCE_M,
            collision_detection_distance=_NEAR_M,
        )
        self.limits = [mink.VelocityLimit(model, speeds), self._ranges, self._collisions]
        """Limits of speeds, ranges and collisions, as mink objects."""
        rows = [limit.compute_qp_inequalities(kinematics.configuration, _AHEAD_S) for limit in self.limits]
        self._G, self._h = np.vstack([row.G for row in rows]), np.concatenate([row.h for row in rows])
        n_speeds, n_ranges = len(rows[0].h), len(rows[1].h)
        self._range_rows = slice(n_speeds, n_speeds + n_ranges)
        self._collision_rows = slice(n_speeds + n_ranges, None)
        self._no_lower = np.full(self._h.size, -1e30)
        self._inequalities = np.zeros(self._h.size, dtype=np.int32)

    def solve(self, twist: Array, fastest_m_s: float = np.inf) -> Solution:
        """Return joint velocities for a twist of the tip; zero when the limits leave no solution.

        Args:
            twist: Shape (6,) [m/s, rad/s].
            fastest_m_s: Speed limit of the tip, needed because the closest feasible twist may be faster
                than the wanted one [m/s].
        """
        kinematics = self._kinematics
        target = moved(kinematics.tip, _AHEAD_S * twist)
        self.task.set_target(mink.SE3(np.concatenate([target[3:], target[:3]])))
        displacement = self._displacement()
        velocities = np.zeros(self._home_rad.size) if displacement is None else displacement / _AHEAD_S
        achieved = kinematics.jacobian() @ velocities
        speed = _length(achieved[:3])
        if speed > fastest_m_s:
            velocities, achieved = (vector * (fastest_m_s / speed) for vector in (velocities, achieved))
        missing = achieved - twist
        return Solution(velocities, _length(missing[:3]), _length(missing[3:]))

    def _displacement(self) -> Array | None:
        """Solve for the joints' displacement within `_AHEAD_S`.

        Shape (N,) [rad]; None when the limits leave no solution.
        """
        configuration, ranges = self._kinematics.configuration, self._ranges
        W, error, _ = self.task.compute_qp_residual(configuration)
        H = W.T @ W
        H.flat[:: len(H) + 1] += _DAMPING
        q, limited = configuration.q, ranges.indices
        self._h[self._range_rows] = ranges.gain * np.concatenate(
            [(ranges.upper - q)[limited], (q - ranges.lower)[limited]]
        )
        near = self._collisions.compute_qp_inequalities(configuration, _AHEAD_S)
        self._G[self._collision_rows], self._h[self._collision_rows] = near.G, near.h
        c = -(error @ W)
        if len(q) > len(W):
            c -= _DAMPING * self._homing(q, W)
        displacement, _, status, _ = daqp.solve(
            H, c, self._G, self._h, self._no_lower, self._inequalities, primal_tol=_TOLERANCE
        )
        return displacement if status > 0 else None

    def _homing(self, q: Array, W: Array) -> Array:
        """Return the displacement towards the rest posture that does not move the tip. Shape (N,) [rad]."""
        most = _HOMING_RAD_S * _AHEAD_S
        home = np.clip((self._home_rad - q) * (_AHEAD_S / _HOMING_S), -most, most)
        return home - np.linalg.lstsq(W, W @ home, rcond=1e-3)[0]


def _length(vector: Array) -> float:
    return math.sqrt(vector @ vector)


def ramped(before: Array, wanted: Array, accelerations: Array, dt_s: float) -> Array:
    """Limit the change from joint velocities to wanted ones to what the drives reach in a period. Shape (N,).

    All joints cover the same share of the change, so that the tool changes its velocity along a straight
    line.
    """
    change = wanted - before
    share = float((np.abs(change) / (accelerations * dt_s)).max())
    return wanted if share <= 1.0 else before + change / share
