"""Kinematic pre-flight check, computed without moving: joint angles for the successive poses of a motion.

It decides before the motion starts whether the arm can move the last 20 cm into a receptacle with a bent wrist, as an arm
that can no longer turn its tool freely jams in the bore, and whether the joints allow the planned motion to be followed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm import arm
from farhand.common.arm.engine import mink
from farhand.common.arm.kinematics import Kinematics, compose, difference, moved
from farhand.common.arm.velocity_ik import VelocityIk
from farhand.common.wire.reasons import Code, Reason, because

Array = NDArray[np.float64]

WAY_M = 0.20
"""Length of the trajectory, which ends at the bottom [m]."""

_STEP_M, _STEP_RAD = 0.005, 0.05
_ITERATIONS = 4
_DAMPING = 1e-6
# Near a singularity the solver would leap; the elbow of a redundant arm stays near its rest posture.
_STEP_JOINT_RAD, _TIP_DIMS, _POSTURE_COST = 0.3, 6, 1e-3


class InsertionTrajectory:
    """Trajectory of one arm into a receptacle.

    Args:
        kinematics: A copy for this purpose alone.
    """

    def __init__(self, kinematics: Kinematics):
        self.kinematics = kinematics
        """Kinematics at the point of the trajectory reached so far."""
        robot, model = kinematics.cell.robot, kinematics.model
        steps = dict.fromkeys(arm.joint_names(robot), np.array([_STEP_JOINT_RAD]))
        self._limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, steps)]
        self._task = mink.FrameTask(arm.TIP, "site", position_cost=1.0, orientation_cost=0.3)
        self._tasks = [self._task]
        if model.nv > _TIP_DIMS:
            posture = mink.PostureTask(model, cost=_POSTURE_COST)
            posture.set_target(np.array(robot.home_rad))
            self._tasks.append(posture)

    def go(self, joints_rad: Array, receptacle: Array) -> Iterator[Array]:
        """Move from these angles straight to a point before the receptacle, then to its bottom.

        Args:
            joints_rad: Present joint angles. Shape (N,) [rad].
            receptacle: Pose of the receptacle. Shape (7,).

        Yields:
            Each pose where the tip should be. Shape (7,).
        """
        self.kinematics.update(joints_rad)
        depth_m = self.kinematics.cell.receptacle.depth_m
        for pose in _straight(self.kinematics.tip, in_bore(receptacle, depth_m - WAY_M)):
            self.reach(pose)
        for depth in np.linspace(depth_m - WAY_M, depth_m, round(WAY_M / _STEP_M) + 1):
            pose = in_bore(receptacle, depth)
            self.reach(pose)
            yield pose

    def reach(self, pose: Array) -> None:
        """Move to a nearby pose, as closely as the joints allow. Shape (7,)."""
        configuration = self.kinematics.configuration
        self._task.set_target(mink.SE3(np.concatenate([pose[3:], pose[:3]])))
        for _ in range(_ITERATIONS):
            velocity = mink.solve_ik(
                configuration, self._tasks, 1.0, "daqp", damping=_DAMPING, limits=self._limits
            )
            configuration.integrate_inplace(velocity, 1.0)


def in_bore(receptacle: Array, depth_m: float) -> Array:
    """Return a pose on the axis of a receptacle, at this depth behind its mouth [m]. Shape (7,)."""
    return compose(receptacle, np.array([0.0, 0.0, depth_m, 1.0, 0.0, 0.0, 0.0]))


def _straight(start: Array, end: Array) -> list[Array]:
    """Interpolate poses between two poses, at most a step apart."""
    way = difference(start, end)
    steps = max(np.linalg.norm(way[:3]) / (4 * _STEP_M), np.linalg.norm(way[3:]) / _STEP_RAD, 1.0)
    return [moved(start, part * way) for part in np.linspace(0.0, 1.0, int(np.ceil(steps)) + 1)[1:]]


REFUSED_BELOW = 0.02
"""Least singular value below which an insertion is refused."""
WARNED_BELOW = 0.03
"""Least singular value below which the operator is warned."""

_WORST_M, _WORST_RAD = 0.002, np.radians(1.0)
_BEHIND_M, _BEHIND_RAD = 0.010, 0.1
"""Distance to a planned pose beyond which the arm cannot follow: the servo's largest lead."""
_TRIES = 2
"""Steps for one pose: an arm that falls behind is waited for, a little."""


@dataclass(frozen=True)
class Preflight:
    """Result of a pre-flight check.

    Args:
        least_singular_value: Least singular value of the Jacobian along the path, with a radian weighted as
            0.3 m.
        worst_m: Largest position error of the tip [m].
        worst_rad: Largest orientation error of the tool [rad].
    """

    least_singular_value: float
    worst_m: float
    worst_rad: float

    @property
    def refusal(self) -> Reason | None:
        """Reason not to begin the insertion; None when it may begin."""
        if self.worst_m > _WORST_M or self.worst_rad > _WORST_RAD:
            return because(Code.OUT_OF_REACH, missed_m=self.worst_m, missed_rad=self.worst_rad)
        if self.least_singular_value < REFUSED_BELOW:
            return because(Code.WRIST_STRAIGHT, singular_value=self.least_singular_value)
        return None

    @property
    def warning(self) -> Reason | None:
        """Warning for the operator before the insertion; None for none."""
        if self.refusal is None and self.least_singular_value < WARNED_BELOW:
            return because(Code.WRIST_NEARLY_STRAIGHT, singular_value=self.least_singular_value)
        return None


class Preflights:
    """Pre-flight checks of one arm.

    Args:
        kinematics: A copy for this purpose alone.
    """

    def __init__(self, kinematics: Kinematics):
        self._way_in = InsertionTrajectory(kinematics)
        self._ik = VelocityIk(kinematics)

    def examine(self, joints_rad: Array, receptacle: Array) -> Preflight:
        """Move from these angles straight to a point before the receptacle, then into it.

        Args:
            joints_rad: Present joint angles. Shape (N,) [rad].
            receptacle: Pose of the receptacle. Shape (7,).
        """
        kinematics = self._way_in.kinematics
        least, worst = np.inf, np.zeros(2)
        for pose in self._way_in.go(joints_rad, receptacle):
            error = difference(kinematics.tip, pose)
            worst = np.maximum(worst, [np.linalg.norm(error[:3]), np.linalg.norm(error[3:])])
            least = min(least, kinematics.least_singular_value())
        return Preflight(float(least), *worst.tolist())

    def follow(self, joints_rad: Array, planned: Array, step_s: float) -> Reason | None:
        """Follow a planned motion from these angles; return the reason why the joints cannot, None if they can.

        Args:
            joints_rad: Present joint angles. Shape (N,) [rad].
            planned: Poses of the tip. Shape (M, 7).
            step_s: Time between two of them [s].
        """
        kinematics = self._way_in.kinematics
        kinematics.update(joints_rad)
        poses = [*_straight(kinematics.tip, planned[0]), *planned]
        for k, pose in enumerate(poses):
            if (missed := self._missed(pose, step_s)) is not None:
                share = 100.0 * k / len(poses)
                return because(Code.JOINTS_END, missed_m=missed[0], missed_rad=missed[1], share=share)
        return None

    def _missed(self, pose: Array, step_s: float) -> tuple[float, float] | None:
        """Move to the next pose as the servo would; return the error if the arm falls behind [m, rad]."""
        kinematics, missed = self._way_in.kinematics, (0.0, 0.0)
        for _ in range(_TRIES):
            velocities = self._ik.solve(difference(kinematics.tip, pose) / step_s).joint_velocities
            kinematics.configuration.integrate_inplace(velocities, step_s)
            error = difference(kinematics.tip, pose)
            missed = float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))
            if missed[0] <= _BEHIND_M and missed[1] <= _BEHIND_RAD:
                return None
        return missed
