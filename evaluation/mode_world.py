"""The shipped supervisor with its surroundings, all of it copyable, in virtual time.

The world of the exhaustive check: a point plant that can feel a force, sight that can be lost, operators
whose every message is made here, and a network that keeps old messages to deliver them once more.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from functools import cache
from typing import Any

import msgspec
import numpy as np

from common import model_file
from common.clock import BootClock
from common.control_mode import Action, ControlMode, Phase
from common.keys import Channel
from common.messages import (
    Command,
    CommandReply,
    Heartbeat,
    LeaseRequest,
    Message,
    ModelTransfer,
    OperatorInput,
    PlannedPath,
    Stamp,
    Stop,
    Wish,
)
from common.task import Limits, PointTask, Sample, Target
from common.task_frame import TaskFrame
from local_site.learning.online_learner import LearnerSettings, OnlineLearner
from local_site.samples import sample_strokes
from remote_site.config import RemoteConfig
from remote_site.planner import PlanRequest
from remote_site.plant import EffectorState, PointPlant
from remote_site.supervisor import Supervisor

DT_S = 0.05
"""A slow control loop: the rules are about modes, and a tick costs the search time."""
ROUND_TRIP_S = 0.1
_HEARTBEAT_TICKS, _RENEWAL_TICKS = 2, 20
_START_M, _ORIGIN_M = (0.2, 0.5), (0.5, 0.5)

TASK = PointTask(
    name="check",
    n_dims=2,
    frame_names=("goal",),
    workspace_m=(1.0, 1.0),
    start_m=_START_M,
    target=Target(origin_m=_ORIGIN_M, amplitude_m=(0.0, 0.0)),
    require_preview=True,
    lost_link="hold",
    retract_m=(-0.1, 0.0),
    samples=(Sample(waypoints_m=(_START_M, (0.35, 0.52), _ORIGIN_M), duration_s=1.0),),
    limits=Limits(speed_m_s=0.6, acceleration_m_s2=4.0),
)
CONFIG = RemoteConfig(control_hz=1.0 / DT_S)


@cache
def good_model() -> ModelTransfer:
    """A model of the task, as it travels."""
    learner = OnlineLearner(LearnerSettings(max_distance_m=0.1, min_std_m=0.01), 2, TASK.frame_names)
    frames = [TaskFrame(np.eye(2), np.array(_ORIGIN_M))]
    for stroke in sample_strokes(TASK):
        learner.start()
        learner.observe_many(stroke.position_m, frames, stroke.time_s.tolist())
        learner.end()
    content = model_file.encode(learner.model())
    return ModelTransfer(task=TASK.name, sha256=model_file.content_hash(content), content=content)


class Source:
    """The virtual time behind a clock [ns]."""

    def __init__(self, start_s: float):
        self.ns = round(start_s * 1e9)

    def __call__(self) -> int:
        """Now."""
        return self.ns


class FeelingPlant(PointPlant):
    """The point with a force on it that the world sets [N]."""

    force_n = 0.0

    def read(self) -> EffectorState:
        """See `Plant.read`."""
        state = super().read()
        return EffectorState(state.position_m, state.velocity_m_s, np.array([-self.force_n, 0.0]))


class Sight:
    """Perception of a target that stands still, while it is seen."""

    def __init__(self) -> None:
        self.seen, self.offset_m, self.broken = True, 0.0, False

    def observe(self, now_s: float) -> list[TaskFrame] | None:
        """See `Perception.observe`."""
        del now_s
        if not self.seen:
            return None
        x = np.nan if self.broken else _ORIGIN_M[0] + self.offset_m
        return [TaskFrame(np.eye(2), np.array([x, _ORIGIN_M[1]]))]

    def true_origin_m(self, now_s: float) -> None:
        """See `Perception.true_origin_m`."""
        del now_s


@dataclass
class Operator:
    """One local site, as far as the robot hears of it.

    Args:
        name: Its name and its session.
        lease_id: What it holds, or once held.
        coupling_id: The coupling that it was told last.
        present: Whether it sends heartbeats and renewals.
        last: Its last command, for a network that delivers it again.
        plan_id: The plan that it was shown last.
    """

    name: str
    lease_id: str = ""
    coupling_id: int = 0
    present: bool = True
    last: Command | None = None
    plan_id: int = 0


class World:
    """One robot, its surroundings and its operators.

    Args:
        n_operators: How many.
    """

    def __init__(self, n_operators: int):
        self.operators = [Operator(name) for name in ("ann", "bob")[:n_operators]]
        self.plant = FeelingPlant(np.array(_START_M), np.ones(2), 0.6, 4.0)
        self.sight = Sight()
        self.n_boots = 0
        self.counter = 0
        self._boot()

    def _boot(self) -> None:
        self.n_boots += 1
        # The clock of a new boot begins anew: only its name tells an old stamp from a new one.
        self.source = Source(100.0)
        self.clock = BootClock(f"boot {self.n_boots}", self.source)
        self.said: list[Message] = []
        self.plan_request: PlanRequest | None = None
        self.robot = Supervisor(
            TASK, CONFIG, self.plant, self.sight, self.clock, self._hear, self._take_plan, _forget
        )  # fmt: skip

    def restart(self) -> None:
        """The remote process ends and is started again; the plant stays where it stopped."""
        position = self.plant.read().position_m
        self.plant = FeelingPlant(position, np.ones(2), 0.6, 4.0)
        self._boot()

    def copy(self) -> World:
        """Another world that is the same; what never changes is shared."""
        shared = [TASK, CONFIG, *self.robot.models.all()]
        return copy.deepcopy(self, {id(thing): thing for thing in shared})

    # The network --------------------------------------------------------------------------------

    def _hear(self, _channel: Channel, message: Message) -> None:
        self.said.append(message)
        for operator in self.operators:
            if getattr(message, "coupling_id", 0):
                operator.coupling_id = message.coupling_id  # type: ignore[attr-defined]

    def _take_plan(self, request: PlanRequest) -> None:
        if request.plan_id:
            self.plan_request = request

    def echo(self, age_s: float = ROUND_TRIP_S) -> Stamp:
        """The stamp that a message of this age echoes."""
        return Stamp(self.clock.boot, max(0, self.source.ns - round(age_s * 1e9)))

    # What operators send ------------------------------------------------------------------------

    def ask_lease(self, operator: Operator, wish: Wish = Wish.CONTROL) -> None:
        """A renewal, or a request."""
        request = LeaseRequest(session=operator.name, site_name=operator.name, wish=wish, echo=self.echo())
        reply = self.robot.on_lease(request)
        operator.lease_id = reply.lease_id if reply.granted else operator.lease_id

    def command(self, operator: Operator, action: Action, **changes: Any) -> CommandReply:
        """A fresh command of an operator, but for what is changed in it."""
        self.counter += 1
        command = Command(
            command_id=f"{operator.name} {self.n_boots} {self.counter}", session=operator.name,
            lease_id=operator.lease_id, action=action, echo=self.echo(), task=TASK.name,
            model_sha256=good_model().sha256, plan_id=operator.plan_id,
        )  # fmt: skip
        command = msgspec.structs.replace(command, **changes)
        operator.last = command
        return self.robot.on_command(command)

    def hand(self, operator: Operator, age_s: float = ROUND_TRIP_S, coupling_id: int | None = None) -> None:
        """One input of an operator's hand, away from the target."""
        self.counter += 1
        self.robot.on_input(
            OperatorInput(
                seq=self.counter,
                echo=self.echo(age_s),
                lease_id=operator.lease_id,
                coupling_id=operator.coupling_id if coupling_id is None else coupling_id,
                position_m=(0.3, 0.3 + 0.2 * (self.counter % 2)),
            )
        )

    def stop(self, operator: Operator) -> None:
        """A stop."""
        self.counter += 1
        self.robot.on_stop(Stop(stop_id=f"stop {self.counter}", site_name=operator.name))

    def finish_plan(self) -> None:
        """The worker has made the plan that was asked for last."""
        request, self.plan_request = self.plan_request, None
        if request is None:
            return
        points = np.zeros((2, 2), dtype="<f4").tobytes()
        path = PlannedPath(
            path_id=request.path_id, plan_id=request.plan_id, stamp=request.stamp, n_coordinates=2, step_s=0.1,
            model_sha256=request.stored.sha256, points=points, reaches_end=True,
        )  # fmt: skip
        self.robot.on_path(request, path, "")
        for operator in self.operators:
            operator.plan_id = request.plan_id

    # Time ---------------------------------------------------------------------------------------

    def run(self, duration_s: float, late_s: float = 0.0) -> None:
        """Let time pass; who is present says so."""
        for tick in range(max(1, round(duration_s / DT_S))):
            self.source.ns += round(DT_S * 1e9)
            for operator in self.operators:
                if operator.present and tick % _HEARTBEAT_TICKS == 0:
                    self.counter += 1
                    alive = Heartbeat(session=operator.name, seq=self.counter, echo=self.echo())
                    self.robot.contact.heartbeat(alive)
                if operator.present and tick % _RENEWAL_TICKS == _RENEWAL_TICKS - 1:
                    self.ask_lease_if_held(operator)
            self.robot.tick(DT_S, late_s)

    def ask_lease_if_held(self, operator: Operator) -> None:
        """Renew what an operator holds."""
        if self.robot.contact.lease.holder == operator.name:
            self.ask_lease(operator)

    def run_to_the_end(self) -> None:
        """Let an execution come to the end of its motion, or a manoeuvre to its own."""
        self.run(DT_S)
        for _ in range(100):
            if self.robot.mode is not ControlMode.AUTONOMOUS or self.robot.phase.at_end:
                return
            self.run(0.2)

    @property
    def speed_m_s(self) -> float:
        """Of the effector [m/s]."""
        return float(np.linalg.norm(self.plant.read().velocity_m_s))

    @property
    def phase(self) -> Phase:
        """Of the robot."""
        return self.robot.phase


def _forget(**_fields: Any) -> None:
    """Nobody reads the event log of a world."""
