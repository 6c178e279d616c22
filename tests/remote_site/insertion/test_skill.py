"""The insertion skill on an arm that is no simulation of ours: a tool that goes where it is told, and stops at a wall."""

from __future__ import annotations

import numpy as np
import pytest
from msgspec import UNSET, UnsetType

from farhand.common.arm.compliance import SeenReceptacle
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.model.manifold import POSE
from farhand.common.model.model_file import content_hash, encode
from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.messages import ArmState, ModelTransfer
from farhand.remote_site.insertion.skill import InsertionSkill
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.interface.plant import EffectorState
from farhand.remote_site.perception.target_filter import Estimate
from farhand.remote_site.reproduction.executor_settings import ExecutorSettings
from farhand.remote_site.robots.point_embodiment import NoWorld
from tests.messages import said
from tests.remote_site.arm_bench import HOT_STAB, hot_stab_model
from tests.remote_site.bench import Bench

RECEPTACLE = np.array([0.78, 0.0, 0.38, 0.5, -0.5, 0.5, -0.5])
FRAME = TaskFrame.at(RECEPTACLE)
DT_S, SPEED_M_S = 0.01, 0.15


class PlainArm:
    """A tool without joints or servo. Behind `wall_m` in the bore it meets a spring of 20 kN/m."""

    def __init__(self, wall_m: float):
        self._wall_m = wall_m
        self.point = FRAME.to_world(np.array([0.0, 0.0, -0.2, 1.0, 0.0, 0.0, 0.0]))
        self._velocity = np.zeros(6)
        self.seen: list[SeenReceptacle] = []
        self.tared = 0

    @property
    def depth_m(self) -> float:
        return float(FRAME.to_local(self.point)[2])

    @property
    def force_n(self) -> float:
        return 2e4 * max(self.depth_m - self._wall_m, 0.0)

    @property
    def near(self) -> bool:
        return self.depth_m > -0.03

    @property
    def seated(self) -> bool:
        return self.depth_m > 0.07 and self.force_n > 5.0

    def set_receptacle(self, receptacle: SeenReceptacle | None, presses: bool = True) -> None:
        assert receptacle is not None
        self.seen.append(receptacle)

    def tare(self) -> None:
        self.tared += 1

    def read(self) -> EffectorState:
        load = np.concatenate([-self.force_n * FRAME.A[:, 2], np.zeros(3)])
        return EffectorState(self.point.copy(), self._velocity.copy(), load)

    def accelerate(self, acceleration: np.ndarray, dt_s: float) -> None:
        self._go(self._velocity + dt_s * acceleration, dt_s)

    def follow(self, point: np.ndarray, max_speed_m_s: float, dt_s: float) -> None:
        way = 5.0 * POSE.log(self.point, point)
        self._go(way * min(1.0, max_speed_m_s / max(float(np.linalg.norm(way[:3])), 1e-9)), dt_s)

    def brake(self, dt_s: float) -> None:
        self._go(np.zeros(6), dt_s)

    def _go(self, velocity: np.ndarray, dt_s: float) -> None:
        self._velocity = velocity * min(1.0, SPEED_M_S / max(float(np.linalg.norm(velocity[:3])), 1e-9))
        inwards = float(self._velocity[:3] @ FRAME.A[:, 2])
        allowed = 1e-3 * (60.0 - self.force_n)  # it yields, as a servo with a limit of force does
        self._velocity[:3] += (min(inwards, allowed) - inwards) * FRAME.A[:, 2]
        self.point = POSE.exp(self.point, dt_s * self._velocity)


class PlainSight:
    """Sees the receptacle where it is."""

    newest = Estimate(RECEPTACLE, np.zeros(6), np.eye(6), jumps=0, quiet=True)

    def observe(self, now_s: float) -> list[TaskFrame]:
        return [FRAME]

    def true_origin_m(self, now_s: float) -> None:
        return None


class PlainHardware:
    control_hz, max_speed_m_s = 1.0 / DT_S, SPEED_M_S
    settings = ExecutorSettings(dt_s=DT_S, horizon_s=0.6, max_speed_m_s=SPEED_M_S)

    def __init__(self, wall_m: float):
        self.plant, self.perception = PlainArm(wall_m), PlainSight()

    def arm_state(self, effector: EffectorState, overruns: int) -> ArmState | UnsetType:
        return UNSET

    def sketch(self) -> bytes:
        return b""

    def scene(self) -> bytes:
        return b""


def executing(wall_m: float) -> tuple[Bench, PlainArm]:
    """A hot-stab by commands that has begun on the plain arm."""
    hardware = PlainHardware(wall_m)
    skill = InsertionSkill(HOT_STAB, hardware.plant, hardware.perception, hardware.plant.point, SPEED_M_S)
    embodiment = Embodiment(hardware, skill, NoWorld(hardware.perception))
    bench = Bench(HOT_STAB, embodiment=embodiment).armed()
    content = encode(hot_stab_model())
    sha256 = bench.send_model(
        ModelTransfer(task=HOT_STAB.name, sha256=content_hash(content), content=content)
    ).sha256
    reply = bench.command(Action.EXECUTE, model_sha256=sha256, plan_id=bench.preview(sha256))
    assert reply.accepted, reply.reason
    return bench, hardware.plant


def test_a_plug_is_seated_by_an_arm_that_only_offers_the_interface():
    bench, arm = executing(wall_m=0.085)
    bench.run(15.0)
    assert bench.robot.phase is Phase.SEATED and arm.depth_m == pytest.approx(0.086, abs=0.003)
    assert arm.tared == 1
    np.testing.assert_allclose(arm.seen[-1].pose[:3], RECEPTACLE[:3], atol=1e-9)


def test_a_jam_is_felt_left_and_tried_again_until_it_is_given_up():
    bench, arm = executing(wall_m=0.030)
    depths_m = []
    while bench.mode is ControlMode.AUTONOMOUS and len(depths_m) < 9000:
        bench.run(DT_S)
        if bench.robot.phase is Phase.RECOVERING:
            depths_m.append(arm.depth_m)
    assert min(depths_m) < 0.008  # 30 mm back
    assert bench.mode is ControlMode.HOLD and said(bench.events("gave up")[0]) == "jammed too often"
