"""Hardware of any arm, simulated or driven: rates, speeds, drawing, pre-flight check."""

from __future__ import annotations

from dataclasses import replace

from numpy import float64
from numpy.typing import NDArray

from farhand.common.arm.cell import Cell
from farhand.common.arm.compliance import ComplianceSettings
from farhand.common.arm.kinematics import AT_ORIGIN, Kinematics, difference
from farhand.common.arm.preflight import Preflights
from farhand.common.arm.servo import ServoSettings
from farhand.common.arm.setpoint import MotionLimits
from farhand.common.arm.simulation.description import describe, sketch
from farhand.common.arm.simulation.simulation import TICK_S
from farhand.common.errors import InvalidConfiguration
from farhand.common.task import ArmTask
from farhand.common.wire.messages import ArmState
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.embodiment import Check
from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.reproduction.executor_settings import ExecutorSettings, Path

Array = NDArray[float64]

CONTROL_HZ = 1.0 / TICK_S
"""Only control rate of an arm [Hz]."""
_HORIZON_S = 0.6


class ArmHardware:
    """Part of an arm's `Hardware` that does not depend on its driver.

    Args:
        task: The first task.
        config: Control rate.
        cell: Arm in front of its receptacle.

    Raises:
        InvalidConfiguration: When another control rate is configured.
    """

    control_hz = CONTROL_HZ

    def __init__(self, task: ArmTask, config: RemoteConfig, cell: Cell):
        if config.control_hz not in (None, CONTROL_HZ):
            expected = f"{CONTROL_HZ:g} for an arm, got {config.control_hz:g}"
            raise InvalidConfiguration("remote configuration", "control_hz", expected)
        limits = MotionLimits.of(cell.robot)
        self.max_speed_m_s = min(task.limits.speed_m_s, limits.speed_m_s)
        self._cell, self._acceleration = cell, min(task.limits.acceleration_m_s2, limits.acceleration_m_s2)
        self.settings = ExecutorSettings(
            dt_s=TICK_S,
            horizon_s=_HORIZON_S,
            max_speed_m_s=self.max_speed_m_s,
            max_angular_speed_rad_s=limits.angular_speed_rad_s,
        )

    def servo_settings(self, compliance: ComplianceSettings) -> ServoSettings:
        """Return the settings of the arm's motion within the task's limits."""
        limits = MotionLimits.of(self._cell.robot)
        return ServoSettings(
            replace(limits, speed_m_s=self.max_speed_m_s, acceleration_m_s2=self._acceleration), compliance
        )

    def plan_checks(self, kinematics: Kinematics) -> None:
        """Prepare `examine` with kinematics at home."""
        self._preflights = Preflights(kinematics)

    def examine(self, effector: EffectorState, receptacle: Array | None, plan: Path) -> Check:
        """Solve the inverse kinematics straight into the bore, if given, and along the plan. Shape (7,)."""
        assert effector.joints_rad is not None
        found = Check()
        if receptacle is not None:
            insertion = self._preflights.examine(effector.joints_rad, receptacle)
            found = Check(insertion.refusal, insertion.warning)
        if found.refusal is None:
            refusal = self._preflights.follow(effector.joints_rad, plan.points_world, plan.step_s)
            found = found._replace(refusal=refusal)
        return found

    def arm_state(self, effector: EffectorState, overruns: int) -> ArmState:
        """See `Hardware`."""
        x, y, z = difference(AT_ORIGIN, effector.point)[3:].tolist()
        assert effector.joints_rad is not None
        return ArmState((x, y, z), tuple(effector.joints_rad.tolist()), effector.contact_n or 0.0, overruns)

    def scene(self) -> bytes:
        """See `Hardware`."""
        return describe(self._cell).content

    def sketch(self) -> bytes:
        """See `Hardware`."""
        return sketch(self._cell).content
