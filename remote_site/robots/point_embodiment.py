"""Embodiment of the paper's point: a plant, a target and a ready position.

Record of an execution that ends with tracking a target: the distance from it since the arrival.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from msgspec import UNSET, UnsetType, structs
from numpy.typing import NDArray

from farhand.common.clock import BootClock
from farhand.common.mode_table import Action, Phase
from farhand.common.task import AnyTask, PointTask
from farhand.common.wire.messages import ArmState
from farhand.common.wire.reasons import Reason
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.embodiment import (
    ArmMemory,
    Belief,
    Embodiment,
    ExaminePath,
    Guidance,
    World,
)
from farhand.remote_site.interface.goals import SPEED, FixedGoal, ManoeuvreGoal, giving_way
from farhand.remote_site.interface.plant import EffectorState, Plant, PointPlant
from farhand.remote_site.interface.sensing import Perception, Sensing, TrueTarget
from farhand.remote_site.perception.simulated_sight import OscillatingTarget, SimulatedPerception
from farhand.remote_site.reproduction.executor_settings import ExecutorSettings
from farhand.remote_site.robots.plant_memory import PlantState

Array = NDArray[np.float64]

_OTHER_PLACE = 1000
"""Difference between the seeds of the frames' places at the robot and at the operator's site."""
_RECORD_S = 10.0
"""Time after the arrival over which the error is accumulated [s]."""


class TrackingRecord:
    """Distance to the true target after the arrival.

    Args:
        perception: Sight of the robot; a simulation's is a `TrueTarget` as well.
    """

    def __init__(self, perception: Perception):
        self._target = perception if isinstance(perception, TrueTarget) else None
        self._sum_squares = 0.0
        self._n = 0
        self.tracked_s = 0.0
        self.newest_m: float | None = None

    def measure(self, effector: EffectorState, arrived: bool, now_s: float, dt_s: float) -> None:
        """See `Record.measure`."""
        if not arrived:
            return
        truth_m = self._target.true_origin_m(now_s) if self._target is not None else None
        self.add(None if truth_m is None else float(np.linalg.norm(effector.position_m - truth_m)), dt_s)

    def add(self, distance_m: float | None, dt_s: float) -> None:
        """Record one control period; the distance is None where nobody knows it [m]."""
        if self.tracked_s < _RECORD_S:
            self.tracked_s += dt_s
            if distance_m is not None:
                self._sum_squares += distance_m**2
                self._n += 1
        if distance_m is not None:
            self.newest_m = distance_m

    @property
    def rms_m(self) -> float | None:
        """Root mean square over the recorded time [m]."""
        return math.sqrt(self._sum_squares / self._n) if self._n else None

    def fields(self) -> dict[str, Any]:
        """See `Record.fields`."""
        return {"tracked_s": self.tracked_s, "rms_error_m": self.rms_m, "end_error_m": self.newest_m}


CONTROL_HZ = 50.0
"""Default control rate [Hz]."""


class PointHardware:
    """Plant and sight of a point, see `Hardware`.

    Args:
        task: Task whose limits apply.
        plant: The point.
        perception: Sight of the robot.
        control_hz: Control rate [Hz].
    """

    def __init__(self, task: PointTask, plant: Plant, perception: Perception, control_hz: float):
        self.plant, self.perception, self.control_hz = plant, perception, control_hz
        self.max_speed_m_s = task.limits.speed_m_s
        self.settings = ExecutorSettings(
            dt_s=1.0 / control_hz,
            max_speed_m_s=task.limits.speed_m_s,
            max_acceleration_m_s2=task.limits.acceleration_m_s2,
        )

    def arm_state(self, effector: EffectorState, overruns: int) -> ArmState | UnsetType:
        """See `Hardware`."""
        return UNSET

    def scene(self) -> bytes:
        """See `Hardware`."""
        return b""

    def sketch(self) -> bytes:
        """See `Hardware`."""
        return b""


class PointSkill:
    """Skill without touch: the belief is the sight.

    Args:
        task: The first task.
    """

    must_seat = False

    def __init__(self, task: PointTask):
        self.task = task

    def begin(self, task: AnyTask, now_s: float) -> None:
        """See `Skill`; nothing must be prepared."""
        assert isinstance(task, PointTask)
        self.task = task

    def believe(self, sensing: Sensing, executing: bool, now_s: float, dt_s: float) -> Belief:
        """See `Skill`."""
        return Belief(sensing.seen)

    def apply(self, guidance: Guidance) -> None:
        """See `Skill`."""

    def confined(self, reference: Array, sensing: Sensing) -> Array:
        """See `Skill`."""
        return reference

    def goal(self, phase: Phase, sensing: Sensing) -> ManoeuvreGoal | None:
        """See `Skill`."""
        effector, task = sensing.effector, self.task
        speed_m_s = SPEED * task.limits.speed_m_s
        if phase is Phase.BACKING_OFF:
            return giving_way(effector, speed_m_s)
        if phase is Phase.RETRACTING and task.retract_m is not None:
            place = effector.point + sensing.goal.A @ np.array(task.retract_m)
        elif phase is Phase.GOING_TO_READY:
            place = np.array(task.start_m if task.ready_m is None else task.ready_m)
        else:
            return None
        return FixedGoal.to(np.clip(place, 0.0, task.workspace_m), effector.point, speed_m_s)

    def refusal(self, action: Action, sensing: Sensing) -> Reason | None:
        """See `Skill`."""
        return None

    def end_phase(self, sensing: Sensing) -> Phase:
        """See `Skill`."""
        force_n = sensing.effector.contact_n
        seated = force_n is not None and force_n >= self.task.limits.contact_n
        return Phase.SEATED if seated else Phase.ARRIVED

    def check(self, task: AnyTask, sensing: Sensing) -> ExaminePath | None:
        """See `Skill`."""


class NoWorld:
    """World of a real machine: it is measured by sight alone, has no movable target, and stores nothing.

    Args:
        perception: Sight of the robot.
    """

    def __init__(self, perception: Perception):
        self._perception = perception

    def new_record(self, task: AnyTask) -> TrackingRecord:
        """See `World`."""
        return TrackingRecord(self._perception)

    def move_target(self, position_m: Array) -> None:
        """See `World`; without a simulation the target cannot be moved."""

    def receptacle(self) -> Array | None:
        """See `World`."""

    def memory(self, task: AnyTask) -> ArmMemory | None:
        """See `World`."""


def point_embodiment(
    task: PointTask,
    plant: Plant,
    perception: Perception,
    control_hz: float = CONTROL_HZ,
    world: World | None = None,
) -> Embodiment:
    """Return the embodiment of a point.

    Args:
        task: The first task.
        plant: The point.
        perception: Sight of the robot.
        control_hz: Control rate [Hz].
        world: Knowledge that only a simulation has; none when not given.
    """
    hardware = PointHardware(task, plant, perception, control_hz)
    return Embodiment(hardware, PointSkill(task), world or NoWorld(perception))


class SimulatedPoint(NoWorld):
    """Simulated point with its target: the `World` of its embodiment.

    Args:
        task: The first task.
        config: Control rate, and the seed of its target's phase and noise.
        clock: The target's time.
        remembered: State in its last boot.
    """

    def __init__(
        self, task: PointTask, config: RemoteConfig, clock: BootClock, remembered: PlantState | None
    ):
        self._clock, self._workspace_m, limits = clock, task.workspace_m, task.limits
        phase = float(np.random.default_rng(config.seed).uniform(0.0, 2.0 * np.pi))
        targets = [
            structs.replace(target, origin_m=tuple(mean.tolist()))
            for target, mean in zip(task.targets, task.means_m(config.seed + _OTHER_PLACE), strict=True)
        ]
        self._target = OscillatingTarget(targets[-1], phase)
        before = [
            SimulatedPerception.of_oscillating(
                OscillatingTarget(mark, phase + number), mark.noise_std_m, config.seed + number
            )
            for number, mark in enumerate(targets[:-1], start=1)
        ]
        sight = SimulatedPerception.of_oscillating(self._target, task.target.noise_std_m, config.seed, before)
        super().__init__(sight)
        start_m = np.clip(remembered.position_m if remembered else task.start_m, 0.0, task.workspace_m)
        plant = PointPlant(start_m, np.array(task.workspace_m), limits.speed_m_s, limits.acceleration_m_s2)
        self.embodiment = point_embodiment(task, plant, sight, config.control_hz or CONTROL_HZ, self)

    def move_target(self, position_m: Array) -> None:
        """See `World`; the target stays in the workspace."""
        self._target.move_to(np.clip(position_m, 0.0, self._workspace_m), self._clock.now_s())
