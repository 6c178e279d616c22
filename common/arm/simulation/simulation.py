"""Simulation of arm, receptacle and water, one control period at a time.

The world of the simulation is the vehicle: seen from there, sway of the vehicle is a motion of everything
else. Its inertial forces on the arm are neglected: 0.4 N for a sway of 50 mm at 0.2 Hz.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm import arm
from farhand.common.arm.cell import Cell
from farhand.common.arm.engine import MjData, MjModel, mujoco
from farhand.common.arm.kinematics import compose, inverse
from farhand.common.arm.simulation import receptacle
from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.scene import STEP_S, compile_scene
from farhand.common.errors import FarhandError, InvalidInput

Array = NDArray[np.float64]

TICK_S = 0.01
"""Control period [s]."""
_STEPS = round(TICK_S / STEP_S)
_FRACTIONS = np.arange(1, _STEPS + 1)[:, None] / _STEPS


class PhysicsFailed(FarhandError):
    """Warning of MuJoCo about a number that is not finite, or about omitted contacts."""


@dataclass(frozen=True)
class Insertion:
    """Pose of the plug's tip relative to the receptacle.

    Args:
        depth_m: Depth behind the mouth, along the bore [m].
        lateral_m: Distance from the bore's axis [m].
        tilt_rad: Angle between the axes of plug and bore [rad].
    """

    depth_m: float
    lateral_m: float
    tilt_rad: float


class Simulation:
    """Deterministic physics: the same calls give the same bits.

    Args:
        cell: Cell of everything.
    """

    def __init__(self, cell: Cell):
        self.cell = cell
        self._model = compile_scene(self.cell)
        self._data = mujoco.MjData(self._model)
        self._tip = self._data.site(arm.TIP)
        self._mouth = self._data.site(receptacle.MOUTH)
        self._hand = self._model.body(arm.tool_name(cell.robot)).id
        self._n = len(cell.robot.joints)
        self._gravity = self._model.opt.gravity.copy()
        self._spring = _Spring(self._model, self._n)
        self._wrench = np.zeros(6)
        self._around = Surroundings.still(self.cell)
        self.reset(np.array(cell.robot.home_rad), self._around)

    def reset(self, joints_rad: Array, surroundings: Surroundings) -> None:
        """Reset everything to rest.

        Args:
            joints_rad: Joint angles of the arm. Shape (N,) [rad].
            surroundings: Surroundings; the receptacle is at its place at once.

        Raises:
            InvalidInput: When an angle is missing, not finite or beyond its joint's range.
        """
        joints = np.asarray(joints_rad, dtype=float)
        limited, span = self._model.jnt_limited[: self._n] == 1, self._model.jnt_range[: self._n]
        if joints.shape != (self._n,) or not np.isfinite(joints).all():
            raise InvalidInput("simulation", "joints_rad", f"{self._n} finite angles, got {joints_rad}")
        if (limited & ((joints < span[:, 0]) | (joints > span[:, 1]))).any():
            raise InvalidInput("simulation", "joints_rad", f"angles within {span.tolist()}, got {joints}")
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[: self._n] = joints
        self._spring.rest_at(self._data, surroundings.receptacle_from_vehicle())
        self._surround(surroundings, np.zeros(3))
        mujoco.mj_forward(self._model, self._data)
        self._wrench = -self._data.sensordata
        self._check()

    def step(self, joint_velocities: Array, surroundings: Surroundings) -> None:
        """Simulate one control period.

        Args:
            joint_velocities: Commands of the arm's velocity servos. Shape (N,) [rad/s].
            surroundings: Surroundings at the period's end; the receptacle moves there steadily.

        Raises:
            PhysicsFailed: When MuJoCo warned.
        """
        data = self._data
        self._surround(surroundings, (surroundings.vehicle[:3] - self._around.vehicle[:3]) / TICK_S)
        path = self._spring.path(surroundings.receptacle_from_vehicle())
        data.ctrl[: self._n] = joint_velocities
        wrench = np.zeros(6)
        for target in path:
            data.ctrl[self._n :] = target
            mujoco.mj_step(self._model, data)
            wrench -= data.sensordata  # the sensor measures the arm's action on the tool
        self._wrench = wrench / _STEPS
        # After a step, MuJoCo's positions are those of the previous step.
        mujoco.mj_kinematics(self._model, data)
        self._check()

    @property
    def time_s(self) -> float:
        """Time since the last reset [s]."""
        return self._data.time

    @property
    def joints_rad(self) -> Array:
        """Joint angles of the arm. Shape (N,) [rad]."""
        return self._data.qpos[: self._n].copy()

    @property
    def joint_velocities(self) -> Array:
        """Joint velocities of the arm. Shape (N,) [rad/s]."""
        return self._data.qvel[: self._n].copy()

    @property
    def wrench(self) -> Array:
        """Wrench on the tool, mean over the last period: force [N] and torque about the wrist [Nm].

        Shape (6,), in the axes of the tool. The tool's weight is included, as in a real sensor.
        """
        return self._wrench.copy()

    @property
    def tip(self) -> Array:
        """True pose of the plug's tip, from the vehicle. Shape (7,)."""
        return _pose(self._tip)

    @property
    def mouth(self) -> Array:
        """True pose of the receptacle, from the vehicle. Shape (7,)."""
        return _pose(self._mouth)

    @property
    def insertion(self) -> Insertion:
        """Pose of the plug's tip relative to the receptacle."""
        x, y, z, _, qx, qy, _ = compose(inverse(self.mouth), self.tip)
        cosine = 1.0 - 2.0 * (qx * qx + qy * qy)
        return Insertion(float(z), float(np.hypot(x, y)), float(np.arccos(np.clip(cosine, -1.0, 1.0))))

    @property
    def deflection_m(self) -> float:
        """Return the distance of the receptacle from the rest of its spring [m]."""
        return self._spring.deflection_m(self._data)

    def model_and_data(self) -> tuple[MjModel, MjData]:
        """Return MuJoCo's model and data, for `rendering` to read."""
        return self._model, self._data

    def _surround(self, surroundings: Surroundings, vehicle_m_s: Array) -> None:
        option = self._model.opt
        option.gravity[:] = surroundings.to_vehicle(self._gravity)
        option.wind[:] = surroundings.to_vehicle(surroundings.current_m_s - vehicle_m_s)
        self._data.xfrc_applied[self._hand, :3] = surroundings.to_vehicle(surroundings.push_n)
        self._around = surroundings

    def _check(self) -> None:
        counts = self._data.warning.number
        if counts.any():
            kind = int(np.argmax(counts > 0))
            name = mujoco.mjtWarning(kind).name
            raise PhysicsFailed(f"MuJoCo warned of {name}: what it computes is not physics any more")


class _Spring:
    """Driver of the receptacle's servos.

    Args:
        model: Model of the scene.
        n_joints: Number of the arm's joints, which come first.
    """

    def __init__(self, model: MjModel, n_joints: int):
        self._n = n_joints
        gain = model.actuator_gainprm[n_joints:, 0]
        # With damping against the water alone, the receptacle would lag behind.
        self._lag_s = -model.actuator_biasprm[n_joints:, 2] / gain
        self._target = np.zeros(6)

    def rest_at(self, data: MjData, pose: Array) -> None:
        """Put the receptacle at rest at a pose."""
        self._target = receptacle.joints_at(pose)
        data.qpos[self._n :] = data.ctrl[self._n :] = self._target

    def deflection_m(self, data: MjData) -> float:
        """Distance of the receptacle from the rest of its spring [m]."""
        away = data.qpos[self._n : self._n + 3] - self._target[:3]
        return float(np.sqrt(away @ away))

    def path(self, pose: Array) -> Array:
        """Return the servo targets on the way to a pose. Shape (steps, 6)."""
        start, self._target = self._target, receptacle.joints_at(pose)
        change = self._target - start
        return start + change * _FRACTIONS + self._lag_s * change / TICK_S


def _pose(site: MjData) -> Array:
    out = np.empty(7)
    out[:3] = site.xpos
    mujoco.mju_mat2Quat(out[3:], site.xmat)
    return out
