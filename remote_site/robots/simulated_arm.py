"""Simulated arm with its plug in front of a receptacle: physics, servo, sight and surroundings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.cell import Cell
from farhand.common.arm.compliance import ComplianceSettings
from farhand.common.arm.kinematics import Kinematics
from farhand.common.arm.robot_file import RobotFile
from farhand.common.arm.simulation.disturbances import CALM, Disturbances, DisturbanceSettings
from farhand.common.arm.simulation.disturbances import PRESETS as DISTURBANCES
from farhand.common.arm.simulation.simulation import Simulation
from farhand.common.arm.simulation.starts_and_goals import Box, Placement, Seated, Withdrawn
from farhand.common.errors import InvalidInput
from farhand.common.log import loop_logger
from farhand.common.model.manifold import POSE
from farhand.common.task import AnyTask, ArmTask
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.insertion.jams_and_retries import MAX_ATTEMPTS, Recovery
from farhand.remote_site.insertion.skill import InsertionSkill
from farhand.remote_site.interface.embodiment import ArmMemory, Embodiment
from farhand.remote_site.perception.simulated_sight import (
    CLEAN,
    MarkerTracker,
    SimulatedPerception,
    StillFrames,
    TrackerNoise,
)
from farhand.remote_site.perception.simulated_sight import PRESETS as TRACKERS
from farhand.remote_site.perception.target_filter import AdaptiveFilter
from farhand.remote_site.robots.arm_hardware import ArmHardware
from farhand.remote_site.robots.arm_plant import ArmPlant
from farhand.remote_site.robots.plant_memory import PlantState
from farhand.remote_site.robots.simulated_environment import PlugRecord, SimulatedEnvironment

Array = NDArray[np.float64]

_log = loop_logger(__name__)

_COMPLIANCE = ComplianceSettings()


@dataclass(frozen=True)
class ArmConditions:
    """Conditions of a simulated arm: disturbances, noise, and the countermeasures in use.

    Args:
        noise: Errors of the tracker.
        disturbances: Motions of the receptacle, the vehicle and the water.
        wide: Whether the receptacle may be anywhere in a larger region than the robot's workplace.
        compliance: Compliance of the arm.
        correcting: True if contact corrects the frame.
        attempts: Number of retreats from jams.
    """

    noise: TrackerNoise = CLEAN
    disturbances: DisturbanceSettings = CALM
    wide: bool = False
    compliance: ComplianceSettings = _COMPLIANCE
    correcting: bool = True
    attempts: int = MAX_ATTEMPTS

    @classmethod
    def of(cls, task: ArmTask) -> ArmConditions:
        """Return the conditions of a task."""
        return cls(TRACKERS[task.tracker], DISTURBANCES[task.disturbances])

    def box(self, robot: RobotFile) -> Box:
        """Return the region in which the receptacle may be."""
        box = Box.of(robot)
        return box.widened() if self.wide else box

    def new_recovery(self, enters: bool) -> Recovery:
        """Return the recovery of an execution; `enters` is True for an insertion."""
        return Recovery(self.correcting, self.attempts, enters=enters)


class SimulatedArm(ArmHardware):
    """Simulated arm with its sight and its world: the `Hardware` and the `World` of an embodiment.

    Args:
        task: The first task.
        config: Seed.
        cell: Arm in front of its receptacle.
        remembered: State in its last boot.
        conditions: Disturbances, noise and means against them; those that the task names when not given.
        placement: First place of everything; drawn from the seed when not given.

    Raises:
        InvalidConfiguration: When another control rate is configured.
    """

    def __init__(
        self,
        task: ArmTask,
        config: RemoteConfig,
        cell: Cell,
        remembered: PlantState | None = None,
        conditions: ArmConditions | None = None,
        placement: Placement | None = None,
    ):
        super().__init__(task, config, cell)
        self._conditions = conditions = conditions or ArmConditions.of(task)
        self.simulation = Simulation(cell)
        self._happening = Disturbances(conditions.disturbances, (config.seed, 2))
        self.plant, self.environment = self._start(
            task, remembered.arm if remembered else None, config.seed, placement
        )
        noise = conditions.noise
        self.perception = SimulatedPerception(
            lambda _: self.simulation.mouth,
            MarkerTracker(POSE, noise, config.seed),
            AdaptiveFilter((noise.jitter_m, noise.jitter_rad)),
            [StillFrames(task.still_frames)] if task.landmarks else (),
        )
        kinematics = Kinematics(self.simulation.cell)
        self.plan_checks(kinematics)
        self.skill = InsertionSkill(
            task, self.plant, self.perception, kinematics.tip, self.max_speed_m_s, conditions.new_recovery,
            self.examine,
        )  # fmt: skip
        self.embodiment = Embodiment(self, self.skill, self)

    def _start(
        self, task: ArmTask, remembered: ArmMemory | None, seed: int, placement: Placement | None
    ) -> tuple[ArmPlant, SimulatedEnvironment]:
        """Place the arm as in its last boot, else by `placement`, else by its seed."""
        robot = self.simulation.cell.robot
        settings, box = self.servo_settings(self._conditions.compliance), self._conditions.box(robot)
        if remembered is not None:
            rest = np.array(remembered.receptacle)
            around = SimulatedEnvironment(rest, self._happening, box, remembered.time_s)
            try:
                plant = ArmPlant(self.simulation, around, settings, np.array(remembered.joints_rad))
            except InvalidInput as error:
                _log.warning("the arm starts anew: %s", error)
            else:
                plant.servo.wrist.restore(np.array(remembered.tare))
                return plant, around
        if placement is None:
            place = Placement.sample if task.skill == "insert" else Placement.seated
            placement = place(np.random.default_rng([seed, 1]), box, self.simulation.cell)
        around = SimulatedEnvironment(placement.receptacle, self._happening, box)
        return ArmPlant(self.simulation, around, settings, placement.joints_rad), around

    # World ---------------------------------------------------------------------------------------

    def new_record(self, task: AnyTask) -> PlugRecord:
        """See `World`."""
        inserts = isinstance(task, ArmTask) and task.skill == "insert"
        return PlugRecord(self.simulation, Seated() if inserts else Withdrawn())

    def move_target(self, position_m: Array) -> None:
        """See `World`."""
        self.environment.move_to(position_m, self.plant.time_s)

    def receptacle(self) -> Array:
        """See `World`."""
        return self.simulation.mouth

    def memory(self, task: AnyTask) -> ArmMemory:
        """See `World`."""
        time_s = self.plant.time_s
        still = isinstance(task, ArmTask) and task.disturbances == "calm"
        return ArmMemory(
            tuple(self.simulation.joints_rad.tolist()),
            tuple(self.environment.rest(time_s).tolist()),
            0.0 if still else self.environment.disturbed_s(time_s),
            tuple(self.plant.servo.wrist.bias.tolist()),
        )
