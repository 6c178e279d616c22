"""The simulated arm and its operator in virtual time."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from msgspec import structs

from farhand.common.arm.cell import Cell
from farhand.common.arm.simulation.simulation import Simulation
from farhand.common.configuration import load_toml
from farhand.common.mode_table import Action, Phase
from farhand.common.model.model_file import content_hash, encode
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import ArmTask
from farhand.common.wire.messages import ExecutionReport, ModelReply, ModelTransfer
from farhand.local_site.learning.online_learner import LearnerSettings
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import learn
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.insertion.jams_and_retries import MAX_ATTEMPTS
from farhand.remote_site.robots.plant_memory import PlantState
from farhand.remote_site.robots.simulated_arm import ArmConditions, SimulatedArm
from tests.cells import JACO
from tests.remote_site.bench import Bench

_DEPLOY = Path(__file__).parents[2] / "deploy"
HOT_STAB, HOT_STAB_REMOVAL = (
    load_toml(_DEPLOY / "tasks" / f"{name}.toml", ArmTask) for name in ("hot-stab", "hot-stab-removal")
)


@functools.cache
def hot_stab_model(name: str = "hot-stab") -> TPHSMM:
    """What the demonstrations that come with the task, or with another one, teach."""
    files = sorted((_DEPLOY / "samples").glob(f"{name}-[0-9]*.npz"))
    learning = HOT_STAB.learning
    assert learning.max_distance_m is not None
    settings = LearnerSettings(learning.max_distance_m, min_std_m=learning.min_std_m)
    return learn([Demonstration.load(file) for file in files], settings)


@functools.cache
def seated(cell: Cell = JACO) -> PlantState:
    """What is remembered of a robot that has just inserted its plug."""
    bench = ArmBench(cell=cell).executing()
    bench.run_until(Phase.SEATED)
    bench.run(1.0)
    return bench.remembered


class ArmBench(Bench):
    """The supervisor of a simulated arm, and an operator."""

    def __init__(
        self,
        seed: int = 0,
        remembered: PlantState | None = None,
        cell: Cell = JACO,
        also: Sequence[ArmTask] = (),
        attempts: int = MAX_ATTEMPTS,
        **changes: Any,
    ):
        task = structs.replace(HOT_STAB, **changes)
        conditions = replace(ArmConditions.of(task), attempts=attempts)
        self.arm = SimulatedArm(task, RemoteConfig(seed=seed), cell, remembered, conditions)
        super().__init__(task, embodiment=self.arm.embodiment, also=also)
        self.taught = hot_stab_model()

    @property
    def simulation(self) -> Simulation:
        return self.arm.simulation

    @property
    def depth_m(self) -> float:
        """How deep the plug really is [m]."""
        return self.simulation.insertion.depth_m

    @property
    def force_n(self) -> float:
        return float(np.linalg.norm(self.arm.plant.servo.wrist.force))

    @property
    def report(self) -> ExecutionReport:
        assert self.robot.last_execution is not None
        return self.robot.last_execution.report(self.robot.stamp(), 0)

    @property
    def tip(self) -> np.ndarray:
        """The plug's true pose."""
        return self.simulation.tip

    @property
    def remembered(self) -> PlantState:
        """What its memory file would hold now."""
        return PlantState.of(self.robot.sensing, self.robot.motion)

    def send_model(self, sent: ModelTransfer | None = None) -> ModelReply:
        content = encode(self.taught)
        whole = ModelTransfer(task=self.task.name, sha256=content_hash(content), content=content)
        return super().send_model(sent or whole)

    def executing(self) -> Self:
        self.armed()
        self.run(1.0)
        self.execute()
        return self

    def execute(self) -> None:
        sha256 = self.send_model().sha256
        plan_id = self.preview(sha256)
        reply = self.command(Action.EXECUTE, model_sha256=sha256, plan_id=plan_id)
        assert reply.accepted, reply.reason

    def run_until(self, *phases: Phase, at_most_s: float = 20.0) -> float:
        """Let the control loop run until it is at a phase. Returns the time that it took [s]."""
        for tick in range(round(at_most_s / self.dt_s)):
            if self.robot.phase in phases:
                return tick * self.dt_s
            self.run(self.dt_s)
        raise AssertionError(f"it is {self.robot.mode} {self.robot.phase} after {at_most_s} s")
