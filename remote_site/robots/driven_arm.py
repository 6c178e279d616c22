"""Arm of the user's own, by its driver and its sight: the same servo, skill and checks as the simulated arm's."""

from __future__ import annotations

from typing import Any

from farhand.common.arm.cell import Cell
from farhand.common.arm.compliance import ComplianceSettings
from farhand.common.arm.kinematics import Kinematics
from farhand.common.task import AnyTask, ArmTask
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.insertion.skill import InsertionSkill
from farhand.remote_site.interface.arm_driver import ArmDriver
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.interface.sensing import Perception
from farhand.remote_site.perception.tracked_sight import TrackedSight
from farhand.remote_site.robots.arm_hardware import ArmHardware
from farhand.remote_site.robots.arm_plant import ServoedArm
from farhand.remote_site.robots.point_embodiment import NoWorld, TrackingRecord


class FeltRecord(TrackingRecord):
    """Record of an execution by what the wrist measures; nobody knows where the plug really is.

    Args:
        perception: Sight of the robot.
    """

    def __init__(self, perception: Perception):
        super().__init__(perception)
        self._peak_n = self._sum_n = 0.0
        self._n_held = 0

    def measure(self, effector: EffectorState, arrived: bool, now_s: float, dt_s: float) -> None:
        """See `Record.measure`."""
        super().measure(effector, arrived, now_s, dt_s)
        force_n = effector.contact_n or 0.0
        self._peak_n = max(self._peak_n, force_n)
        if arrived:
            self._sum_n += force_n
            self._n_held += 1

    def fields(self) -> dict[str, Any]:
        """See `Record.fields`."""
        holding_n = self._sum_n / self._n_held if self._n_held else None
        return super().fields() | {"peak_force_n": self._peak_n, "holding_force_n": holding_n}


class DrivenArm(ArmHardware, NoWorld):
    """Arm with its sight, both by drivers of the user's own: the `Hardware` and the `World` of an embodiment.

    Args:
        task: The first task.
        config: Control rate.
        cell: Arm in front of its receptacle.
        driver: Driver of the arm, started.
        sight: Sight of the receptacle, started.

    Raises:
        InvalidConfiguration: When another control rate is configured.
        InvalidInput: When the driver's first reading is not of the agreed form.
    """

    def __init__(self, task: ArmTask, config: RemoteConfig, cell: Cell, driver: ArmDriver, sight: Perception):
        ArmHardware.__init__(self, task, config, cell)
        NoWorld.__init__(self, sight)
        self.plant = ServoedArm(driver, cell, self.servo_settings(ComplianceSettings()))
        self.perception = TrackedSight(sight, len(task.frame_names))
        kinematics = Kinematics(cell)
        self.plan_checks(kinematics)
        skill = InsertionSkill(
            task, self.plant, self.perception, kinematics.tip, self.max_speed_m_s, examine=self.examine
        )
        self.embodiment = Embodiment(self, skill, self)

    def new_record(self, task: AnyTask) -> FeltRecord:
        """See `World`."""
        return FeltRecord(self._perception)
