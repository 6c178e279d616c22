"""Motions of the operator's hand that are asked for by a press: steps, turning along the bore, moving onto its axis.

The hand then moves evenly to its goal, and a recording has the motion of the arm that follows it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.model.manifold import POSE
from farhand.common.model.task_frame import TaskFrame
from farhand.local_site.workcell.arm_view import ArmView

Array = NDArray[np.float64]
HandMotion = Callable[[Array, Array], Array]
"""Returns the goal of a motion from the hand's present pose (7,) and the receptacle's (7,)."""

_SPEED_M_S, _SPEED_RAD_S = 0.05, 0.35
"""Speed of the hand: slow enough that the eye follows, and to press gently."""
_BEFORE_M, _BESIDE_M = (0.01, 0.35), 0.15
"""The hand is moved onto the axis from these distances before the mouth, and from so far beside the axis [m]."""
_ON_AXIS_M, _ALONG_RAD = 0.002, math.radians(1.0)


def align(hand: Array, receptacle: Array) -> Array:
    """Return the pose at the hand's place that points along the bore. Shape (7,)."""
    return np.concatenate([hand[:3], receptacle[3:]])


def centre(hand: Array, receptacle: Array) -> Array:
    """Return the pose on the bore's axis, and along it, as far from the mouth as the hand is. Shape (7,)."""
    frame = TaskFrame.at(receptacle)
    on_axis = np.array([0.0, 0.0, float(frame.to_local(hand)[2])])
    return np.concatenate([frame.to_world(on_axis), receptacle[3:]])


def can_centre(arm: ArmView) -> bool:
    """Decide whether the plug is near enough before the mouth to be moved onto the axis, and not on it yet."""
    before = _BEFORE_M[0] <= -arm.depth_m <= _BEFORE_M[1] and arm.lateral_m <= _BESIDE_M
    return before and (arm.lateral_m > _ON_AXIS_M or arm.tilt_rad > _ALONG_RAD)


@dataclass(frozen=True)
class Nudge:
    """Step of the hand.

    Args:
        move_m: Displacement, relative to the arm's base. Length 3 [m].
        turn_rad: Rotation vector, relative to the arm's base. Length 3 [rad].
    """

    move_m: tuple[float, float, float]
    turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __call__(self, hand: Array, _receptacle: Array) -> Array:
        """Return the pose after the step. Shape (7,)."""
        turned = Rotation.from_rotvec(self.turn_rad) * Rotation.from_quat(hand[3:], scalar_first=True)
        return np.concatenate([hand[:3] + self.move_m, turned.as_quat(scalar_first=True)])


def hand_axes(receptacle: Array) -> Array:
    """Return the task's axes as a person behind the arm names them: to the right, up, and into the bore.

    Of the receptacle's two axes across the bore, the more upright one is `up`, whichever way it points.

    Args:
        receptacle: Pose of the receptacle, z into the bore. Shape (7,).

    Returns:
        One axis per column, relative to the arm's base. Shape (3, 3).
    """
    x, y, into = TaskFrame.at(receptacle).A[:3, :3].T
    up = x if abs(x[2]) > abs(y[2]) else y
    up = up if up[2] >= 0.0 else -up
    return np.column_stack([np.cross(into, up), up, into])


class HandRamp:
    """Hand on its way to a goal.

    Args:
        pose: First pose. Shape (7,).
        goal: Goal. Shape (7,).
    """

    def __init__(self, pose: Array, goal: Array):
        self.pose, self.goal = pose, goal

    @property
    def arrived(self) -> bool:
        """True at the goal."""
        return self.pose is self.goal

    def step(self, duration_s: float) -> Array:
        """Move towards the goal for some time [s]; return the new pose. Shape (7,)."""
        way = POSE.log(self.pose, self.goal)
        needs_s = max(np.linalg.norm(way[:3]) / _SPEED_M_S, np.linalg.norm(way[3:]) / _SPEED_RAD_S)
        self.pose = self.goal if needs_s <= duration_s else POSE.exp(self.pose, duration_s / needs_s * way)
        return self.pose
