"""Arm as a `Plant`, on any driver of its joints; its points are poses of the plug's tip."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.cell import Cell
from farhand.common.arm.compliance import SeenReceptacle
from farhand.common.arm.servo import Servo, ServoSettings
from farhand.common.arm.setpoint import MotionLimits
from farhand.common.arm.simulation.disturbances import Surroundings
from farhand.common.arm.simulation.simulation import TICK_S, Simulation
from farhand.common.errors import InvalidInput
from farhand.remote_site.interface.arm_driver import ArmDriver, ArmReading, check_reading
from farhand.remote_site.interface.driver import Monitored, call_all, halts_of
from farhand.remote_site.interface.plant import EffectorState

Array = NDArray[np.float64]


class ServoedArm:
    """Arm whose driver is told joint velocities by a servo.

    Args:
        driver: Driver of the joints, started.
        cell: The arm in front of its receptacle.
        settings: Settings of the arm's motion.

    Raises:
        InvalidInput: When the driver's reading is not of the agreed form, here and in `read`.
    """

    def __init__(self, driver: ArmDriver, cell: Cell, settings: ServoSettings | None = None):
        self._driver, self._n_joints = driver, len(cell.robot.joints)
        self._halts, self._monitored = halts_of(driver), driver if isinstance(driver, Monitored) else None
        self._reading = self._measured()
        settings = settings or ServoSettings(MotionLimits.of(cell.robot))
        self.servo = Servo(cell, settings, self._reading.joints_rad)
        """Servo; it reports `servo.solution` and `servo.governor`."""
        self._moved = False

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

    @property
    def fault(self) -> str:
        """See `Monitored`."""
        return self._monitored.fault if self._monitored is not None else ""

    def halt(self) -> None:
        """See `Haltable`."""
        call_all(self._halts)

    def tare(self) -> None:
        """Tare the wrist's force and torque sensor."""
        self.servo.wrist.tare()

    def read(self) -> EffectorState:
        """See `Plant.read`; the arm is measured once after each command."""
        if self._moved:
            self._measure()
        servo, reading = self.servo, self._reading
        velocity = servo.kinematics.jacobian() @ reading.joint_velocities
        load = np.concatenate([servo.wrist.force, servo.wrist.torque])
        setpoint = (servo.setpoint.pose.copy(), servo.setpoint.velocity.copy())
        return EffectorState(servo.tip, velocity, load, setpoint, servo.carried, reading.joints_rad)

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
        self._driver.command(joint_velocities, dt_s)
        self._moved = True

    def _measure(self) -> None:
        self._reading = self._measured()
        self.servo.measure(self._reading.joints_rad, self._reading.wrench)
        self._moved = False

    def _measured(self) -> ArmReading:
        reading = self._driver.read()
        check_reading(reading, self._n_joints)
        return reading


class SimulatedJoints:
    """Driver of a simulated arm; the time of the simulation advances with each command.

    Args:
        simulation: Physics; it is reset.
        surroundings: Returns the disturbances of the arm at a time of the simulation [s].
        joints_rad: First joint angles. Shape (N,) [rad].

    Raises:
        InvalidInput: When the angles are impossible.
    """

    def __init__(
        self, simulation: Simulation, surroundings: Callable[[float], Surroundings], joints_rad: Array
    ):
        simulation.reset(joints_rad, surroundings(0.0))
        self._simulation, self._surroundings = simulation, surroundings
        self._ticks = 0

    @property
    def time_s(self) -> float:
        """Time of the simulation [s]."""
        return self._ticks * TICK_S

    def read(self) -> ArmReading:
        """See `ArmDriver.read`."""
        physics = self._simulation
        return ArmReading(physics.joints_rad, physics.joint_velocities, physics.wrench)

    def command(self, joint_velocities: Array, dt_s: float) -> None:
        """See `ArmDriver.command`."""
        if abs(dt_s - TICK_S) > 1e-9:
            raise InvalidInput(
                "arm plant", "dt_s", f"the simulation's control period, {TICK_S} s, got {dt_s}"
            )
        self._ticks += 1
        self._simulation.step(joint_velocities, self._surroundings(self.time_s))


class ArmPlant(ServoedArm):
    """Simulated arm under water in front of a receptacle.

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
        self.simulation = simulation
        """Source of the true state."""
        first = np.array(simulation.cell.robot.home_rad) if joints_rad is None else joints_rad
        self._joints = SimulatedJoints(simulation, surroundings, first)
        super().__init__(self._joints, simulation.cell, settings)

    @property
    def time_s(self) -> float:
        """Time of the simulation [s]."""
        return self._joints.time_s

    def _move(self, joint_velocities: Array, dt_s: float) -> None:
        super()._move(joint_velocities, dt_s)
        self._measure()  # its time has advanced with the command
