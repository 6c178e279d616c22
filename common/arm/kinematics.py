"""Kinematics of the arm alone, as its controller knows them: no physics, and no surroundings but the panel.

Twists are tangents of `farhand.common.model.manifold.POSE` at the tool: [m/s, in the axes of the base] and
[rad/s, in the axes of the tool].
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm import arm
from farhand.common.arm.dimensions import LINK, Dimensions
from farhand.common.arm.engine import MjModel, mink, mjcf, mujoco
from farhand.common.arm.poses import compose

Array = NDArray[np.float64]

BOARD = "board"
"""Name of the panel's geom, for collisions."""

_METRES_PER_RADIAN = 0.3
_BOARD_HALF_M = 0.01
_ELSEWHERE = np.array([0.0, 0.0, -10.0, 1.0, 0.0, 0.0, 0.0])


class Kinematics:
    """Kinematics of the arm at some joint angles.

    Args:
        dimensions: Of the arm.
    """

    def __init__(self, dimensions: Dimensions):
        self.dimensions = dimensions
        self.configuration = mink.Configuration(_model(dimensions).__copy__())
        """Configuration for mink's tasks and limits."""
        self.model: MjModel = self.configuration.model
        self._tip = self.model.site(arm.TIP).id
        self._tool = self.model.body(arm.TOOL).id
        behind = dimensions.receptacle.panel_behind_m + _BOARD_HALF_M
        self._board_in_receptacle = np.array([0.0, 0.0, behind, 1.0, 0.0, 0.0, 0.0])
        self.place_panel(None)
        self.update(np.array(dimensions.home_rad))

    def update(self, joints_rad: Array) -> None:
        """Set the joint angles. Shape (6,) [rad]."""
        self.configuration.update(joints_rad)

    def place_panel(self, receptacle: Array | None) -> None:
        """Place the panel around a receptacle with this pose, or remove it. Shape (7,)."""
        pose = _ELSEWHERE if receptacle is None else compose(receptacle, self._board_in_receptacle)
        data = self.configuration.data
        data.mocap_pos[0], data.mocap_quat[0] = pose[:3], pose[3:]

    @property
    def joints_rad(self) -> Array:
        """Joint angles. Shape (6,) [rad]."""
        return self.configuration.q.copy()

    @property
    def tip(self) -> Array:
        """Pose of the plug's tip. Shape (7,)."""
        data, out = self.configuration.data, np.empty(7)
        out[:3] = data.site_xpos[self._tip]
        mujoco.mju_mat2Quat(out[3:], data.site_xmat[self._tip])
        return out

    def jacobian(self) -> Array:
        """Return the Jacobian from joint velocities to the tip's twist. Shape (6, 6)."""
        data, J = self.configuration.data, np.zeros((6, 6))
        mujoco.mj_jacSite(self.model, data, J[:3], J[3:], self._tip)
        J[3:] = data.site_xmat[self._tip].reshape(3, 3).T @ J[3:]
        return J

    def least_singular_value(self) -> float:
        """Return the Jacobian's least singular value, a radian weighted as 0.3 m; zero at a singularity."""
        J = self.jacobian()
        J[3:] *= _METRES_PER_RADIAN
        return float(np.linalg.svd(J, compute_uv=False)[-1])

    def tool_weight(self) -> tuple[float, Array]:
        """Return the mass behind the wrist [kg], and its centre from the wrist in the tool's axes [m]."""
        data, model = self.configuration.data, self.model
        axes = data.site_xmat[self._tip].reshape(3, 3)
        wrist = data.site_xpos[self._tip] - axes[:, 2] * self.dimensions.plug.reach_m
        return float(model.body_subtreemass[self._tool]), axes.T @ (data.subtree_com[self._tool] - wrist)


@cache
def _model(dimensions: Dimensions) -> MjModel:
    root = mjcf.RootElement(model="kinematics")
    root.attach(arm.make_arm(dimensions))
    board = root.worldbody.add("body", name=BOARD, mocap=True)
    width, height = (0.5 * edge for edge in dimensions.receptacle.panel_m)
    size = (width, height, _BOARD_HALF_M)
    board.add("geom", name=BOARD, type="box", size=size, contype=LINK, conaffinity=LINK)
    return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())
