"""Composition of rigid-body poses, as MuJoCo computes with them.

Poses are points of `farhand.common.model.manifold.POSE`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.engine import mujoco
from farhand.common.model.manifold import exp_at, log_at

Array = NDArray[np.float64]

AT_ORIGIN = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
"""Pose at the origin, without rotation."""


def compose(first: Array, second: Array) -> Array:
    """Return ``T_a_c`` from ``T_a_b`` and ``T_b_c``. Shape (7,)."""
    out = np.empty(7)
    mujoco.mju_mulPose(out[:3], out[3:], first[:3], first[3:], second[:3], second[3:])
    return out


def inverse(pose: Array) -> Array:
    """Return ``T_b_a`` from ``T_a_b``. Shape (7,)."""
    out = np.empty(7)
    mujoco.mju_negPose(out[:3], out[3:], pose[:3], pose[3:])
    return out


def rotation(pose: Array) -> Array:
    """Return the orientation of a pose as a matrix. Shape (3, 3)."""
    out = np.empty(9)
    mujoco.mju_quat2Mat(out, pose[3:])
    return out.reshape(3, 3)


def moved(pose: Array, tangent: Array) -> Array:
    """Return the pose that a tangent leads to. Shape (7,)."""
    out = np.empty(7)
    exp_at(pose, tangent, out)
    return out


def difference(base: Array, pose: Array) -> Array:
    """Return the tangent that leads from one pose to another. Shape (6,)."""
    out = np.empty(6)
    log_at(base, pose, out)
    return out


def shortened(vector: Array, longest: float) -> Array:
    """Clip a vector to a maximum length and keep its direction."""
    length = math.sqrt(vector @ vector)
    return vector if length <= longest else vector * (longest / length)
