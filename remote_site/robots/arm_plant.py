"""Simulated arm as a `Plant`; its points are poses of the plug's tip."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.compliance import SeenReceptacle
from farhand.common.arm.servo import Servo, ServoSettings
from farhand.common.arm.setpoint import MotionLimits
from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.simulation import TICK_S, Simulation
from farhand.common.errors import InvalidInput
from farhand.remote_site.interface.plant import EffectorState

Array = NDArray[np.float64]


class ArmPlant:
    """Arm under water in front of a receptacle.

    Args:
        simulation: Physics; it is reset.
        surroundings: Returns the disturbances of the arm at a time of the simulation [s].
        settings: Settings of the arm's motion.
        joints_rad: First joint angles. Shape (N,) [rad]; home when not given.

    Raises:
        InvalidInput: When the angles are impossible.
    """

    def __init__(
        self,
        simulation: Simulation,
        surroundings: Callable[[float], Surroundings],
        settings: ServoSettings | None = None,
        joints_rad: Array | None = None,
    ):
        joints = np.array(simulation.cell.robot.home_rad) if joints_rad is None else joints_rad
        simulation.reset(joints, surroundings(0.0))
        self.simulation = simulation
        """Source of the true state."""
        self.servo = Servo(
            simulation.cell,
            settings or ServoSettings(MotionLimits.of(simulation.cell.robot)),
            joints,
        )
        """Servo; it reports `servo.solution` and `servo.governor`."""
        self._surroundings = surroundings
        self._ticks = 0

    @property
    def time_s(self) -> float:
        """Time of the simulation [s]."""
        return self._ticks * TICK_S

    def set_receptacle(self, receptacle: SeenReceptacle | None, presses: bool = True) -> None:
        """Set the estimated receptacle, None while it is unknown; valid until the next call.

        Near the receptacle the arm moves relative to it, limits its pressing force, and keeps its links off
        the panel. A plug that is to be extracted must not be pressed in: see `Servo.set_receptacle`.
        """
        self.servo.set_receptacle(receptacle, presses)

    @property
    def near(self) -> bool:
        """True while the plug is in its receptacle or close in front of it."""
        return self.servo.governor.active

    @property
    def seated(self) -> bool:
        """True while the arm presses the plug against the bottom."""
        return self.servo.governor.seated

    def tare(self) -> None:
        """Tare the wrist's force and torque sensor."""
        self.servo.wrist.tare()

    def read(self) -> EffectorState:
        """See `Plant.read`."""
        servo = self.servo
        velocity = servo.kinematics.jacobian() @ self.simulation.joint_velocities
        load = np.concatenate([servo.wrist.force, servo.wrist.torque])
        setpoint = (servo.setpoint.pose.copy(), servo.setpoint.velocity.copy())
        return EffectorState(servo.tip, velocity, load, setpoint, servo.carried, self.simulation.joints_rad)

    def accelerate(self, acceleration: Array, dt_s: float) -> None:
        """See `Plant.accelerate`."""
        self._move(self.servo.accelerate(acceleration, dt_s), dt_s)

    def follow(self, point: Array, max_speed_m_s: float, dt_s: float) -> None:
        """See `Plant.follow`."""
        self._move(self.servo.follow(point, max_speed_m_s, dt_s), dt_s)

    def brake(self, dt_s: float) -> None:
        """See `Plant.brake`."""
        self._move(self.servo.brake(dt_s), dt_s)

    def _move(self, joint_velocities: Array, dt_s: float) -> None:
        if abs(dt_s - TICK_S) > 1e-9:
            raise InvalidInput(
                "arm plant", "dt_s", f"the simulation's control period, {TICK_S} s, got {dt_s}"
            )
        self._ticks += 1
        self.simulation.step(joint_velocities, self._surroundings(self.time_s))
        self.servo.measure(self.simulation.joints_rad, self.simulation.wrench)
