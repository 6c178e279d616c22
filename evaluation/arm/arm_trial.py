"""One task of the arm: a learned model, the robot's own sight, touch and guards, the servo, the physics."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.compliance import ComplianceSettings
from farhand.common.arm.poses import AT_ORIGIN, compose, difference, inverse, moved
from farhand.common.arm.servo import ServoSettings
from farhand.common.arm.simulation.disturbances import CALM, Disturbances, DisturbanceSettings, Surroundings
from farhand.common.arm.simulation.goals import Goal, Seated
from farhand.common.arm.simulation.placement import ACCEPTANCE, Box, Placement
from farhand.common.arm.simulation.simulation import TICK_S, PhysicsFailed, Simulation
from farhand.common.errors import InvalidInput
from farhand.common.model.manifold import POSE
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import Limits
from farhand.evaluation.arm.arm_record import HELD_S, Record
from farhand.remote_site.insertion.insertion import Insertion
from farhand.remote_site.insertion.recovery import MAX_ATTEMPTS, Recovery
from farhand.remote_site.perception.adaptive_filter import AdaptiveFilter
from farhand.remote_site.perception.marker_tracker import CLEAN, MarkerTracker, TrackerNoise
from farhand.remote_site.perception.perception import SimulatedPerception
from farhand.remote_site.reproduction.executor_settings import ExecutorSettings
from farhand.remote_site.robots.arm_plant import ArmPlant

Array = NDArray[np.float64]

SETTINGS = ExecutorSettings(dt_s=TICK_S, horizon_s=0.6)
_ENOUGH_S = 2.0
_NEVER_S = 1e6
_LOST_FROM_M = -0.040
_SINGULAR_EVERY = 10


@dataclass(frozen=True)
class Conditions:
    """What a trial has to cope with.

    Args:
        noise: Of the tracker.
        disturbances: What moves.
        box: Where the receptacle may be.
        jump_within_m: The step of the receptacle begins when the tip is so far before the mouth [m]; at its
            own time when not given.
        lost_s: From 40 mm before the mouth on the receptacle is out of sight for so long [s].
        correcting: Whether contact corrects the frame.
        admittance: Whether the arm gives way sideways.
        attempts: How often it may go back from a jam.
        obeying: Whether the kinematic pre-flight, which is asked in any case, is obeyed.
    """

    noise: TrackerNoise = CLEAN
    disturbances: DisturbanceSettings = CALM
    box: Box = ACCEPTANCE
    jump_within_m: float | None = None
    lost_s: float = 0.0
    correcting: bool = True
    admittance: bool = True
    attempts: int = MAX_ATTEMPTS
    obeying: bool = False


class Sea:
    """What surrounds the arm in a trial, at any time.

    Args:
        conditions: What there is to cope with.
        rest: Where the receptacle rests. A pose. Shape (7,).
        seed: Of the disturbances.
    """

    def __init__(self, conditions: Conditions, rest: Array, seed: int):
        self._rest, self._seed = rest, (seed, 2)  # not the tracker's numbers again
        settings = conditions.disturbances
        if conditions.jump_within_m is not None:
            settings = replace(settings, step_at_s=_NEVER_S)  # until it is triggered
        self._happening = Disturbances(settings, self._seed)

    def jump(self, now_s: float) -> None:
        """Let the step of the receptacle begin now."""
        self._happening = Disturbances(replace(self._happening.settings, step_at_s=now_s), self._seed)

    def __call__(self, time_s: float) -> Surroundings:
        """All that acts on the arm at a time [s]."""
        happening = self._happening
        return Surroundings(
            moved(self._rest, happening.receptacle(time_s)),
            moved(AT_ORIGIN, happening.vehicle(time_s)),
            happening.current_m_s(time_s),
            happening.push_n(time_s),
        )


class Trial:
    """One trial, ready to run.

    Args:
        model: The learned task.
        conditions: What it has to cope with.
        seed: Of everything random.
        placement: Where everything is at first; random when not given.
        limit_s: It has failed after this time [s].
        goal: What is to be reached; the plug seated when not given.
    """

    def __init__(
        self,
        model: TPHSMM,
        conditions: Conditions,
        seed: int,
        placement: Placement | None = None,
        limit_s: float = 18.0,
        goal: Goal | None = None,
    ):
        simulation = Simulation()
        random = np.random.default_rng([seed, 1])
        placed = placement or Placement.sample(random, conditions.box, simulation.dimensions)
        self._conditions = conditions
        self._sea = Sea(conditions, placed.receptacle, seed)
        gains = ComplianceSettings() if conditions.admittance else _STIFF
        self.arm = ArmPlant(simulation, self._sea, ServoSettings(compliance=gains), placed.joints_rad)
        noise = conditions.noise
        self.perception = SimulatedPerception(
            lambda _: simulation.mouth,
            MarkerTracker(POSE, noise, seed),
            AdaptiveFilter((noise.jitter_m, noise.jitter_rad)),
        )
        self._lost_until_s, self._jumped = math.nan, conditions.jump_within_m is None
        self._limit_s = limit_s
        self._begin(model, goal or Seated())

    def go_on(self, model: TPHSMM, goal: Goal) -> None:
        """Another task from where everything is now; `run` runs it.

        Args:
            model: The learned task.
            goal: What is to be reached.
        """
        self._begin(model, goal, look_s=0.0)

    def _begin(self, model: TPHSMM, goal: Goal, **how: float) -> None:
        conditions, arm = self._conditions, self.arm
        self.record, self._goal = Record(), goal
        recovery = Recovery(conditions.correcting, conditions.attempts, enters=goal.enters)
        preflight = _preflight(arm, self.record, conditions.obeying)
        self.insertion = Insertion(
            arm, self.perception, model, SETTINGS, Limits(), recovery, preflight, arm.time_s, **how
        )
        self._held_s, self._until_s = 0.0, arm.time_s + self._limit_s

    def run(self) -> Record:
        """Until the goal was held, a guard acts, or its time is over."""
        record, began_s = self.record, time.process_time()
        while self._held_s < _ENOUGH_S:
            if self.arm.time_s >= self._until_s:
                record.cause = "" if self._held_s >= HELD_S else "time"
                break
            try:
                record.cause = self.insertion.tick(self.arm.time_s)
            except (PhysicsFailed, InvalidInput) as error:
                record.cause = str(error)
            self._look()
            if record.cause:
                break
        record.tick_s = (time.process_time() - began_s) / max(len(record.local), 1)
        return record

    def _look(self) -> None:
        """Write down what happened, and let happen what depends on where the plug is."""
        arm, record = self.arm, self.record
        simulation, force, now_s = arm.simulation, arm.servo.wrist.force, arm.time_s
        tip = simulation.tip
        local = compose(inverse(simulation.mouth), tip)
        record.local.append(local)
        if not arm.servo.governor.active:
            record.behind.append(difference(arm.servo.setpoint.pose, tip))
        record.force_n.append(math.sqrt(force @ force))
        depth_m = float(local[2])
        if len(record.local) % _SINGULAR_EVERY == 0:
            record.least_singular_value.append(arm.servo.kinematics.least_singular_value())
        good = self._goal.reached(local, record.force_n[-1], simulation)
        self._held_s = self._held_s + TICK_S if good else 0.0
        if good and math.isnan(record.inserted_s):
            record.inserted_s = now_s
        if not self._jumped and depth_m > -(self._conditions.jump_within_m or 0.0):
            self._jumped = True
            self._sea.jump(now_s)
        if self._conditions.lost_s and math.isnan(self._lost_until_s) and depth_m > _LOST_FROM_M:
            self._lost_until_s = now_s + self._conditions.lost_s
        self.perception.in_sight = not now_s < self._lost_until_s


def _preflight(arm: ArmPlant, record: Record, obeying: bool) -> Callable[[Array], str]:
    """Ask, write down, and obey or not; no method of the trial, which would then live until it is found as garbage."""

    def ask(receptacle: Array) -> str:
        record.refusal = arm.preflight(receptacle).refusal
        return record.refusal if obeying else ""

    return ask


_STIFF = ComplianceSettings(lateral_m_s_n=0.0, tilt_rad_s_nm=0.0)
