"""The arm with its plug before a receptacle, simulated: physics, servo, sight, touch, and the way in and out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.compliance import ComplianceSettings
from farhand.common.arm.dimensions import Dimensions
from farhand.common.arm.kinematics import Kinematics
from farhand.common.arm.poses import AT_ORIGIN, difference
from farhand.common.arm.preflight import Preflights
from farhand.common.arm.servo import ServoSettings
from farhand.common.arm.setpoint import MotionLimits
from farhand.common.arm.simulation.description import describe
from farhand.common.arm.simulation.disturbances import CALM, Disturbances, DisturbanceSettings
from farhand.common.arm.simulation.disturbances import PRESETS as DISTURBANCES
from farhand.common.arm.simulation.goals import Seated, Withdrawn
from farhand.common.arm.simulation.placement import ACCEPTANCE, Box, Placement
from farhand.common.arm.simulation.simulation import TICK_S, Simulation
from farhand.common.control_mode import Action, Phase
from farhand.common.errors import InvalidConfiguration, InvalidInput
from farhand.common.log import loop_logger
from farhand.common.model.manifold import POSE
from farhand.common.task import AnyTask, ArmTask
from farhand.common.wire.messages import ArmState
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.insertion.recovery import MAX_ATTEMPTS, Recovery
from farhand.remote_site.insertion.touch import BACK_M_S, Touch, pose_of
from farhand.remote_site.interface.embodiment import Check, Guidance, Way
from farhand.remote_site.motion.manoeuvre import BACK_OFF_M, BACK_OFF_S, Straight, giving_way
from farhand.remote_site.perception.adaptive_filter import AdaptiveFilter
from farhand.remote_site.perception.marker_tracker import CLEAN, MarkerTracker, TrackerNoise
from farhand.remote_site.perception.marker_tracker import PRESETS as TRACKERS
from farhand.remote_site.perception.perception import SimulatedPerception
from farhand.remote_site.perception.sensing import Sensing
from farhand.remote_site.reproduction.executor_settings import ExecutorSettings
from farhand.remote_site.robots.arm_memory import ArmMemory
from farhand.remote_site.robots.arm_plant import ArmPlant
from farhand.remote_site.robots.arm_stage import SimulatedEnvironment
from farhand.remote_site.robots.arm_ways import AlongAxis, confined, free_speed_m_s, in_bore, shifted
from farhand.remote_site.robots.plant_memory import PlantState
from farhand.remote_site.robots.plug_record import PlugRecord
from farhand.remote_site.supervision.guards import force_of

Array = NDArray[np.float64]

_log = loop_logger(__name__)

CONTROL_HZ = 1.0 / TICK_S
"""The only rate of an arm's controller [Hz]."""
_HORIZON_S = 0.6
_LOOK_S = 0.5
"""Before an execution begins the receptacle is looked at, and the wrist's sensor tared, for so long [s]."""
_DEPTH_M, _LATERAL_M = (0.075, 0.095), 0.010
"""A plug is seated when it is believed to be so deep, and not further from the axis than sight is wrong."""
_COMPLIANCE = ComplianceSettings()


@dataclass(frozen=True)
class ArmConditions:
    """What a simulated arm has to cope with, and with what it copes.

    Args:
        noise: Of the tracker.
        disturbances: What moves.
        box: Where the receptacle may be.
        compliance: How the arm gives way.
        correcting: Whether contact corrects the frame.
        attempts: How often it may go back from a jam.
    """

    noise: TrackerNoise = CLEAN
    disturbances: DisturbanceSettings = CALM
    box: Box = ACCEPTANCE
    compliance: ComplianceSettings = _COMPLIANCE
    correcting: bool = True
    attempts: int = MAX_ATTEMPTS

    @classmethod
    def of(cls, task: ArmTask) -> ArmConditions:
        """Return those that a task names."""
        return cls(TRACKERS[task.tracker], DISTURBANCES[task.disturbances])


class ArmEmbodiment:
    """An arm; see `Embodiment` for what each method says.

    Args:
        task: What it is at first.
        config: Its seed.
        remembered: Where it was in its last boot.
        dimensions: Of the arm and its surroundings.
        conditions: What it has to cope with; what the task names when not given.
        placement: Where everything is at first; drawn from the seed when not given.

    Raises:
        InvalidConfiguration: When another control rate is configured.
    """

    control_hz = CONTROL_HZ

    def __init__(
        self,
        task: ArmTask,
        config: RemoteConfig,
        remembered: PlantState | None,
        dimensions: Dimensions | None = None,
        conditions: ArmConditions | None = None,
        placement: Placement | None = None,
    ):
        if config.control_hz not in (None, CONTROL_HZ):
            expected = f"{CONTROL_HZ:g} for an arm, got {config.control_hz:g}"
            raise InvalidConfiguration("remote configuration", "control_hz", expected)
        limits = MotionLimits()
        self.task, self._conditions = task, conditions or ArmConditions.of(task)
        self.max_speed_m_s = min(task.limits.speed_m_s, limits.speed_m_s)
        self._acceleration = min(task.limits.acceleration_m_s2, limits.acceleration_m_s2)
        self.settings = ExecutorSettings(
            dt_s=TICK_S,
            horizon_s=_HORIZON_S,
            max_speed_m_s=self.max_speed_m_s,
            max_angular_speed_rad_s=limits.angular_speed_rad_s,
        )
        self.simulation = Simulation(dimensions)
        self._happening = Disturbances(self._conditions.disturbances, (config.seed, 2))
        self.plant, self.environment = self._start(
            remembered.arm if remembered else None, config.seed, placement
        )
        noise = self._conditions.noise
        self.perception = SimulatedPerception(
            lambda _: self.simulation.mouth,
            MarkerTracker(POSE, noise, config.seed),
            AdaptiveFilter((noise.jitter_m, noise.jitter_rad)),
        )
        self._touch = Touch(self.plant, self.perception, self._new_recovery(), _LOOK_S)
        kinematics = Kinematics(self.simulation.dimensions)
        self._home = kinematics.tip
        self._preflights = Preflights(kinematics)
        self._joints_rad = self.simulation.joints_rad  # of the same moment as what is sensed
        self._look_until_s, self.guidance = -np.inf, Guidance()

    @property
    def must_seat(self) -> bool:
        """See `Embodiment`."""
        return self.task.skill == "insert"

    def _start(
        self, remembered: ArmMemory | None, seed: int, placement: Placement | None
    ) -> tuple[ArmPlant, SimulatedEnvironment]:
        """Put the arm where it was, or else where it is to be, or else where its seed says."""
        limits = MotionLimits(speed_m_s=self.max_speed_m_s, acceleration_m_s2=self._acceleration)
        settings, box = ServoSettings(limits, self._conditions.compliance), self._conditions.box
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
            place = Placement.sample if self.must_seat else Placement.seated
            placement = place(np.random.default_rng([seed, 1]), box, self.simulation.dimensions)
        around = SimulatedEnvironment(placement.receptacle, self._happening, box)
        return ArmPlant(self.simulation, around, settings, placement.joints_rad), around

    def _new_recovery(self) -> Recovery:
        return Recovery(self._conditions.correcting, self._conditions.attempts, enters=self.must_seat)

    # In every control period ---------------------------------------------------------------------

    def attend(self, sensing: Sensing, executing: bool, now_s: float, dt_s: float) -> None:
        """See `Embodiment`."""
        self._joints_rad = self.simulation.joints_rad
        waits = now_s < self._look_until_s
        back = self._touch.update(sensing, executing and not waits, now_s, dt_s)
        given_up = "jammed too often" if self._touch.recovery.given_up else ""
        self.guidance = Guidance(waits, back, BACK_M_S, given_up)

    def begin(self, task: AnyTask, now_s: float) -> None:
        """See `Embodiment`: in free water what was felt is forgotten, and the wrist's sensor tared."""
        assert isinstance(task, ArmTask)
        self.task = task
        recovery = self._new_recovery()
        if self.plant.servo.governor.active:
            recovery.correction = self._touch.recovery.correction
        else:
            self.plant.servo.wrist.tare()
        self._touch.renew(recovery)
        self._look_until_s, self.guidance = now_s + _LOOK_S, Guidance(waits=True)

    def confined(self, reference: Array, sensing: Sensing) -> Array:
        """See `Embodiment`."""
        return confined(reference, sensing)

    def end_phase(self, sensing: Sensing) -> Phase:
        """See `Embodiment`."""
        x, y, z = sensing.frames[0].to_local(sensing.effector.point)[:3]
        inside = _DEPTH_M[0] <= z <= _DEPTH_M[1] and np.hypot(x, y) < _LATERAL_M
        force_n = force_of(sensing.effector) or 0.0
        pressed = self.plant.servo.governor.seated or force_n >= self.task.limits.contact_n
        return Phase.SEATED if inside and pressed else Phase.ARRIVED

    # What is asked -------------------------------------------------------------------------------

    def way(self, phase: Phase, sensing: Sensing) -> Way | None:
        """See `Embodiment`."""
        speed_m_s = free_speed_m_s(self.max_speed_m_s)
        if phase is Phase.BACKING_OFF and not np.isfinite(sensing.unseen_s):
            return giving_way(sensing.effector, speed_m_s)
        along = partial(AlongAxis, sensing=sensing, servo=self.plant.servo, speed_m_s=speed_m_s)
        if phase is Phase.BACKING_OFF:
            back = shifted(sensing, np.array([0.0, 0.0, -BACK_OFF_M]))
            return along(back, distance_m=BACK_OFF_M, time_limit_s=BACK_OFF_S)
        if phase is Phase.RETRACTING and self.task.retract_m is not None:
            by_m = np.array(self.task.retract_m)
            return along(shifted(sensing, by_m), distance_m=float(np.linalg.norm(by_m)))
        if phase is Phase.GOING_TO_READY:
            return Straight.to(self._home, sensing.effector.point, speed_m_s)
        return None

    def refusal(self, action: Action, sensing: Sensing) -> str:
        """See `Embodiment`."""
        if action is Action.GO_TO_READY and in_bore(sensing):
            return "the plug is in the receptacle: retract it first"
        if action is Action.RETRACT and not np.isfinite(sensing.unseen_s):
            return "the robot has not seen its receptacle: it does not know the way out"
        return ""

    def check(self, task: AnyTask, sensing: Sensing) -> Callable[[], Check] | None:
        """See `Embodiment`: the kinematic pre-flight of an insertion."""
        assert isinstance(task, ArmTask)
        if task.skill != "insert":
            return None
        return partial(self._examine, self._joints_rad, pose_of(sensing.frames[0]))

    def _examine(self, joints_rad: Array, receptacle: Array) -> Check:
        found = self._preflights.examine(joints_rad, receptacle)
        return Check(found.refusal, found.warning)

    def move_target(self, position_m: Array) -> None:
        """See `Embodiment`."""
        self.environment.move_to(position_m, self.plant.time_s)

    # What is told --------------------------------------------------------------------------------

    def new_record(self) -> PlugRecord:
        """See `Embodiment`."""
        return PlugRecord(self.simulation, Seated() if self.must_seat else Withdrawn())

    def memory(self) -> ArmMemory:
        """See `Embodiment`."""
        time_s, still = self.plant.time_s, self.task.disturbances == "calm"
        return ArmMemory(
            tuple(self.simulation.joints_rad.tolist()),
            tuple(self.environment.rest(time_s).tolist()),
            0.0 if still else self.environment.disturbed_s(time_s),
            tuple(self.plant.servo.wrist.bias.tolist()),
        )

    def arm_state(self, sensing: Sensing, overruns: int) -> ArmState:
        """See `Embodiment`."""
        rotation = difference(AT_ORIGIN, sensing.effector.point)[3:]
        joints = tuple(self._joints_rad.tolist())
        x, y, z = rotation.tolist()
        return ArmState((x, y, z), joints, force_of(sensing.effector) or 0.0, overruns)

    def scene(self) -> bytes:
        """See `Embodiment`."""
        return describe(self.simulation.dimensions).content
