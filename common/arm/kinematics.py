"""Composition of rigid-body poses, and the kinematics of the arm as its controller uses them.

Twists are tangents of `farhand.common.model.manifold.POSE` at the tool: [m/s, in the axes of the base] and
[rad/s, in the axes of the tool].

Poses are points of `farhand.common.model.manifold.POSE`.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm import arm
from farhand.common.arm.cell import LINK, Cell
from farhand.common.arm.engine import MjModel, mink, mujoco
from farhand.common.arm.robot_model import BOARD
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


_METRES_PER_RADIAN = 0.3
_BOARD_HALF_M = 0.01
_ELSEWHERE = np.array([0.0, 0.0, -10.0, 1.0, 0.0, 0.0, 0.0])


class Kinematics:
    """Kinematics of the arm at some joint angles.

    Args:
        cell: The arm, with its tool and receptacle.
    """

    def __init__(self, cell: Cell):
        self.cell = cell
        self.configuration = mink.Configuration(_model(cell).__copy__())
        """Configuration for mink's tasks and limits."""
        self.model: MjModel = self.configuration.model
        self._tip = self.model.site(arm.TIP).id
        self._tool = self.model.body(arm.tool_name(cell.robot)).id
        behind = cell.receptacle.panel_behind_m + _BOARD_HALF_M
        self._board_in_receptacle = np.array([0.0, 0.0, behind, 1.0, 0.0, 0.0, 0.0])
        self.place_panel(None)
        self.update(np.array(cell.robot.home_rad))

    def update(self, joints_rad: Array) -> None:
        """Set the joint angles. Shape (N,) [rad]."""
        self.configuration.update(joints_rad)

    def place_panel(self, receptacle: Array | None) -> None:
        """Place the panel around a receptacle with this pose, or remove it. Shape (7,)."""
        pose = _ELSEWHERE if receptacle is None else compose(receptacle, self._board_in_receptacle)
        data = self.configuration.data
        data.mocap_pos[0], data.mocap_quat[0] = pose[:3], pose[3:]

    @property
    def joints_rad(self) -> Array:
        """Joint angles. Shape (N,) [rad]."""
        return self.configuration.q.copy()

    @property
    def tip(self) -> Array:
        """Pose of the plug's tip. Shape (7,)."""
        data, out = self.configuration.data, np.empty(7)
        out[:3] = data.site_xpos[self._tip]
        mujoco.mju_mat2Quat(out[3:], data.site_xmat[self._tip])
        return out

    def jacobian(self) -> Array:
        """Return the Jacobian from joint velocities to the tip's twist. Shape (6, N)."""
        data, J = self.configuration.data, np.zeros((6, self.model.nv))
        mujoco.mj_jacSite(self.model, data, J[:3], J[3:], self._tip)
        J[3:] = data.site_xmat[self._tip].reshape(3, 3).T @ J[3:]
        return J

    def least_singular_value(self) -> float:
        """Return the Jacobian's least singular value, a radian weighted as 0.3 m.

        Zero at a singularity, and for an arm with fewer than six joints, which cannot turn its tool freely.
        """
        J = self.jacobian()
        if J.shape[1] < len(J):
            return 0.0
        J[3:] *= _METRES_PER_RADIAN
        return float(np.linalg.svd(J, compute_uv=False)[-1])

    def tool_weight(self) -> tuple[float, Array]:
        """Return the mass behind the wrist [kg], and its centre from the wrist in the tool's axes [m]."""
        data, model = self.configuration.data, self.model
        axes = data.site_xmat[self._tip].reshape(3, 3)
        wrist = data.site_xpos[self._tip] - axes[:, 2] * self.cell.plug.reach_m
        return float(model.body_subtreemass[self._tool]), axes.T @ (data.subtree_com[self._tool] - wrist)


@cache
def _model(cell: Cell) -> MjModel:
    spec = mujoco.MjSpec()
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_NATIVECCD
    arm.add_arm(spec, cell)
    board = spec.worldbody.add_body(name=BOARD, mocap=True)
    width, height = (0.5 * edge for edge in cell.receptacle.panel_m)
    size = (width, height, _BOARD_HALF_M)
    box = mujoco.mjtGeom.mjGEOM_BOX
    board.add_geom(name=BOARD, type=box, size=size, contype=LINK, conaffinity=LINK)
    return spec.compile()
