"""Trial of one task of the arm by commands: the shipped robot, link included, in virtual time."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from farhand.common.arm.cell import Cell
from farhand.common.arm.compliance import ComplianceSettings
from farhand.common.arm.kinematics import compose, difference, inverse
from farhand.common.arm.simulation.simulation import TICK_S
from farhand.common.arm.simulation.starts_and_goals import Goal, Placement, Seated
from farhand.common.clock import VirtualTime
from farhand.common.impairment.impairment import LinkSettings
from farhand.common.impairment.virtual_link import VirtualLink
from farhand.common.mode_table import Action, ControlMode
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import ArmTask, TaskSet
from farhand.deploy.places import find_cell, find_task
from farhand.evaluation.arm.arm_record import HELD_S, TrialRecord
from farhand.evaluation.harness.commander import Commander, NotDone
from farhand.evaluation.harness.virtual_sites import Hooks, VirtualRobot
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.robots.simulated_arm import ArmConditions, SimulatedArm
from farhand.remote_site.supervision.supervisor import Supervisor

STIFF = ComplianceSettings(lateral_m_s_n=0.0, tilt_rad_s_nm=0.0)
"""Settings of an arm that does not yield sideways."""

_ENOUGH_S = 2.0
_NEVER_S = 1e6
_LOST_FROM_M = -0.040
_SINGULAR_EVERY = 10


@dataclass(frozen=True)
class Conditions(ArmConditions):
    """Conditions of a trial.

    Args:
        jump_within_m: Distance of the tip before the mouth at which the receptacle's step begins [m]; at
            its own time when not given.
        lost_s: Time for which the receptacle is out of sight, from 40 mm before the mouth on [s].
        obeying: True if the operator does not execute after a refused preview.
    """

    jump_within_m: float | None = None
    lost_s: float = 0.0
    obeying: bool = False


class Trial:
    """One trial, ready to run.

    Args:
        model: The learned task.
        conditions: Conditions of the trial.
        seed: Seed of all random numbers.
        placement: First placement of arm and receptacle; random when not given.
        limit_s: Time after which the trial has failed [s].
        goal: Goal of the task; the seated plug when not given.
        arm: Name or file of the robot; empty for the usual one.
    """

    def __init__(
        self,
        model: TPHSMM,
        conditions: Conditions,
        seed: int,
        placement: Placement | None = None,
        limit_s: float = 18.0,
        goal: Goal | None = None,
        arm: str = "",
    ):
        if conditions.jump_within_m is not None:  # no step before it is triggered
            never = replace(conditions.disturbances, step_at_s=_NEVER_S)
            conditions = replace(conditions, disturbances=never)
        self._conditions, self._limit_s = conditions, limit_s
        self._model, self._goal, self._began_s = model, goal or Seated(), 0.0
        config, tasks = RemoteConfig(seed=seed), _tasks(self._goal.enters, conditions.obeying)
        assert isinstance(tasks.first, ArmTask)
        self.arm = SimulatedArm(tasks.first, config, arm_cell(arm), None, conditions, placement)
        """The robot's arm."""
        self._time = VirtualTime()
        link = VirtualLink(self._time, LinkSettings())
        self._robot_end, operator_end = link.remote_end(), link.local_end()
        self._running = VirtualRobot(
            self._time,
            self._robot_end,
            config,
            tasks,
            hooks=lambda: self._hooks,
            embodiment=self.arm.embodiment,
        )
        self._hooks = Hooks()
        self._operator = Commander(self._time, operator_end)
        self._lost_until_s, self._jumped = math.nan, conditions.jump_within_m is None
        self._running.start()

    @property
    def began_s(self) -> float:
        """Time when the present task began, on the simulation's clock [s]."""
        return self._began_s

    def go_on(self, model: TPHSMM, goal: Goal) -> None:
        """Prepare another task from the present state; `run` runs it.

        Args:
            model: The learned task.
            goal: Goal of the task.
        """
        self._model, self._goal = model, goal

    def mean_joints_rad(self, duration_s: float) -> NDArray[np.float64]:
        """Let the robot go on for a time; return the means of its joint angles, without the sight's noise. Shape (N,) [rad]."""
        joints_rad = []
        for _ in range(round(duration_s / TICK_S)):
            self._time.run_until(self._time.now_s() + TICK_S)
            joints_rad.append(self.arm.simulation.joints_rad.copy())
        return np.mean(joints_rad, axis=0)

    def run(self) -> TrialRecord:
        """Command the task, and watch it until the goal was held, a guard trips, or its time is over."""
        self.record, self._held_s = TrialRecord(), 0.0
        try:
            self._begin()
        except NotDone as refusal:
            self.record.cause = str(refusal)
            self._observe()  # records the initial poses
            return self.record
        began_s, record = time.process_time(), self.record
        until_s = self._began_s + self._limit_s
        while not record.cause and self._held_s < _ENOUGH_S:
            if self.arm.plant.time_s >= until_s:
                record.cause = "" if self._held_s >= HELD_S else "time"
                break
            self._time.run_until(self._time.now_s() + TICK_S)
            if (
                self._supervisor.mode is not ControlMode.AUTONOMOUS
                or self._supervisor.motion.execution is None
            ):
                record.cause = self._operator.events[-1].reason.code  # it has arrived by now
        self._hooks = Hooks()
        record.tick_s = (time.process_time() - began_s) / max(len(record.local), 1)
        return record

    def _begin(self) -> None:
        """Act as an operator: take control, send the model, preview, execute."""
        operator, name = self._operator, _NAMES[self._goal.enters]
        if operator.report is None:
            operator.take_control()
        elif self._supervisor.mode is ControlMode.AUTONOMOUS and not self._supervisor.phase.at_end:
            operator.do(Action.ABORT)
        named = {"task": name, "model_sha256": operator.send(self._model, name)}
        plan_id = 0
        try:
            plan_id = operator.do(Action.PREVIEW, **named).plan_id
        except NotDone as refusal:
            self.record.refusal = str(refusal)
            if self._conditions.obeying:
                raise NotDone(f"refused: {refusal}") from refusal
        operator.ask(Action.EXECUTE, **named, plan_id=plan_id)
        self._began_s = self.arm.plant.time_s
        self._hooks = Hooks(after=self._look)

    @property
    def _supervisor(self) -> Supervisor:
        return self._running.robot.supervisor

    def _look(self) -> None:
        """Record the control period, and trigger the events that depend on the plug's position."""
        depth_m, now_s = self._observe(), self.arm.plant.time_s
        if not self._jumped and depth_m > -(self._conditions.jump_within_m or 0.0):
            self._jumped = True
            self.arm.environment.jump(now_s)
        if self._conditions.lost_s and math.isnan(self._lost_until_s) and depth_m > _LOST_FROM_M:
            self._lost_until_s = now_s + self._conditions.lost_s
        self.arm.perception.in_sight = not now_s < self._lost_until_s

    def _observe(self) -> float:
        """Record pose and force of the plug; return its depth [m]."""
        arm, record = self.arm.plant, self.record
        simulation, force = arm.simulation, arm.servo.wrist.force
        tip = simulation.tip
        local = compose(inverse(simulation.mouth), tip)
        record.local.append(local)
        if not arm.servo.governor.active:
            record.behind.append(difference(arm.servo.setpoint.pose, tip))
        record.force_n.append(math.sqrt(force @ force))
        if len(record.local) % _SINGULAR_EVERY == 0:
            record.least_singular_value.append(arm.servo.kinematics.least_singular_value())
        good = self._goal.reached(local, record.force_n[-1], simulation)
        self._held_s = self._held_s + TICK_S if good else 0.0
        if good and math.isnan(record.inserted_s):
            record.inserted_s = arm.time_s - self._began_s
        return float(local[2])


_NAMES = {True: "hot-stab", False: "hot-stab-removal"}


def arm_cell(arm: str) -> Cell:
    """Return an arm in front of its receptacle, by the name or file of its robot; empty for the usual one."""
    cell = find_cell(find_task(_NAMES[True]), arm)
    assert cell is not None, "hot-stab is an arm's task"
    return cell


def _tasks(enters: bool, obeying: bool) -> TaskSet:
    """Return both tasks, beginning with the trial's first one."""
    names = (_NAMES[enters], _NAMES[not enters])
    return TaskSet([structs.replace(find_task(name), require_preview=obeying) for name in names])
