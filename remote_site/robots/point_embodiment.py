"""The paper's point: nothing but a plant, a target and a place to be ready at."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from msgspec import UNSET, UnsetType
from numpy.typing import NDArray

from farhand.common.clock import BootClock
from farhand.common.control_mode import Action, Phase
from farhand.common.task import AnyTask, PointTask
from farhand.common.wire.messages import ArmState
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.embodiment import Check, Guidance, Way
from farhand.remote_site.interface.plant import Plant, PointPlant
from farhand.remote_site.motion.manoeuvre import SPEED, Straight, giving_way
from farhand.remote_site.motion.tracking_record import TrackingRecord
from farhand.remote_site.perception.perception import OscillatingTarget, Perception, SimulatedPerception
from farhand.remote_site.perception.sensing import Sensing
from farhand.remote_site.reproduction.executor_settings import ExecutorSettings
from farhand.remote_site.robots.arm_memory import ArmMemory
from farhand.remote_site.robots.plant_memory import PlantState
from farhand.remote_site.supervision.guards import force_of

Array = NDArray[np.float64]

CONTROL_HZ = 50.0
"""Its control rate where the configuration says nothing [Hz]."""


class PointEmbodiment:
    """A point; see `Embodiment` for what each method says.

    Args:
        task: What it is at first.
        plant: It.
        perception: Its sight.
        control_hz: Its control rate [Hz].
    """

    must_seat = False
    guidance = Guidance()

    def __init__(self, task: PointTask, plant: Plant, perception: Perception, control_hz: float = CONTROL_HZ):
        self.plant, self.perception, self.control_hz = plant, perception, control_hz
        self.task = task
        self.max_speed_m_s = task.limits.speed_m_s
        self.settings = ExecutorSettings(
            dt_s=1.0 / control_hz,
            max_speed_m_s=task.limits.speed_m_s,
            max_acceleration_m_s2=task.limits.acceleration_m_s2,
        )

    def attend(self, sensing: Sensing, executing: bool, now_s: float, dt_s: float) -> None:
        """See `Embodiment`: it believes what it sees."""

    def begin(self, task: AnyTask, now_s: float) -> None:
        """See `Embodiment`: it is ready at once."""
        assert isinstance(task, PointTask)
        self.task = task

    def confined(self, reference: Array, sensing: Sensing) -> Array:
        """See `Embodiment`."""
        return reference

    def way(self, phase: Phase, sensing: Sensing) -> Way | None:
        """See `Embodiment`."""
        effector, task = sensing.effector, self.task
        speed_m_s = SPEED * task.limits.speed_m_s
        if phase is Phase.BACKING_OFF:
            return giving_way(effector, speed_m_s)
        if phase is Phase.RETRACTING and task.retract_m is not None:
            goal = effector.point + sensing.frames[0].A @ np.array(task.retract_m)
        elif phase is Phase.GOING_TO_READY:
            goal = np.array(task.start_m if task.ready_m is None else task.ready_m)
        else:
            return None
        return Straight.to(np.clip(goal, 0.0, task.workspace_m), effector.point, speed_m_s)

    def refusal(self, action: Action, sensing: Sensing) -> str:
        """See `Embodiment`."""
        return ""

    def end_phase(self, sensing: Sensing) -> Phase:
        """See `Embodiment`."""
        force_n = force_of(sensing.effector)
        seated = force_n is not None and force_n >= self.task.limits.contact_n
        return Phase.SEATED if seated else Phase.ARRIVED

    def new_record(self) -> TrackingRecord:
        """See `Embodiment`."""
        return TrackingRecord(self.perception)

    def check(self, task: AnyTask, sensing: Sensing) -> Callable[[], Check] | None:
        """See `Embodiment`."""

    def move_target(self, position_m: Array) -> None:
        """See `Embodiment`: a target that is none of the simulation stays where it is."""

    def memory(self) -> ArmMemory | None:
        """See `Embodiment`."""

    def arm_state(self, sensing: Sensing, overruns: int) -> ArmState | UnsetType:
        """See `Embodiment`."""
        return UNSET

    def scene(self) -> bytes:
        """See `Embodiment`."""
        return b""


class SimulatedPoint(PointEmbodiment):
    """A point and its target, simulated.

    Args:
        task: What it is at first.
        config: Its rate, and the seed of its target's phase and noise.
        clock: The target's time.
        remembered: Where it was in its last boot.
    """

    def __init__(
        self, task: PointTask, config: RemoteConfig, clock: BootClock, remembered: PlantState | None
    ):
        self._clock = clock
        phase = float(np.random.default_rng(config.seed).uniform(0.0, 2.0 * np.pi))
        self._target = OscillatingTarget(task.target, phase)
        sight = SimulatedPerception.of_oscillating(self._target, task.target.noise_std_m, config.seed)
        limits = task.limits
        start_m = np.clip(remembered.position_m if remembered else task.start_m, 0.0, task.workspace_m)
        plant = PointPlant(start_m, np.array(task.workspace_m), limits.speed_m_s, limits.acceleration_m_s2)
        super().__init__(task, plant, sight, config.control_hz or CONTROL_HZ)

    def move_target(self, position_m: Array) -> None:
        """See `Embodiment`: it stays in the workspace."""
        self._target.move_to(np.clip(position_m, 0.0, self.task.workspace_m), self._clock.now_s())
