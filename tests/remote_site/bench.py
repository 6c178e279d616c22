"""A robot and its operator in virtual time: nothing here waits, and nothing depends on the machine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self, TypeVar

import numpy as np
from msgspec import structs

from farhand.common.clock import BootClock
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.task import AnyTask, PointTask, TaskSet
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import (
    Command,
    CommandReply,
    Event,
    Heartbeat,
    LeaseReply,
    LeaseRequest,
    Message,
    ModelReply,
    ModelTransfer,
    OperatorInput,
    Stamp,
    Stop,
    Wish,
)
from farhand.evaluation.harness.steered_world import PushedPlant, SteeredSight, SteppedTime
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.interface.plant import PointPlant
from farhand.remote_site.motion.model_trial import ModelTrial
from farhand.remote_site.motion.preview_worker import PlanRequest, answer
from farhand.remote_site.perception.simulated_sight import OscillatingTarget, SimulatedPerception
from farhand.remote_site.robots.point_embodiment import point_embodiment
from farhand.remote_site.supervision.supervisor import Supervisor
from tests.remote_site.planar import TASK, transfer

DT_S = 0.02
_HEARTBEAT_S, _RENEWAL_S = 0.1, 1.0

M = TypeVar("M", bound=Message)


class FeelingPlant(PushedPlant):
    """The point with a force on its tool that the test sets. Keeps what it was told to do."""

    def __init__(self, task: PointTask = TASK):
        super().__init__(task)
        self.told: list[str] = []

    def accelerate(self, acceleration: np.ndarray, dt_s: float) -> None:
        self.told.append("accelerate")
        super().accelerate(acceleration, dt_s)

    def follow(self, point: np.ndarray, max_speed_m_s: float, dt_s: float) -> None:
        self.told.append("follow")
        super().follow(point, max_speed_m_s, dt_s)

    def brake(self, dt_s: float) -> None:
        self.told.append("brake")
        super().brake(dt_s)


class Sight(SteeredSight):
    """Sight of the task's target, as the tracker sees it."""

    def __init__(self, task: PointTask):
        seeing = SimulatedPerception.of_oscillating(
            OscillatingTarget(task.target), task.target.noise_std_m, 0
        )
        super().__init__(lambda now_s: (seeing.observe(now_s) or [None])[0], seeing.true_origin_m)


class Bench:
    """The supervisor of a simulated robot, and an operator who is `delay_s` away, there and back.

    Args:
        task: What the robot does, and the operator asks for at first.
        plant: Another machine than the task's point.
        embodiment: Another robot than a point.
        also: Other tasks that it does.
        delay_s: Age of whatever the operator echoes, when it arrives [s].
    """

    def __init__(
        self,
        task: AnyTask = TASK,
        plant: PointPlant | None = None,
        embodiment: Embodiment | None = None,
        also: Sequence[AnyTask] = (),
        delay_s: float = 0.1,
    ):
        self.task = task
        self.time = SteppedTime()
        self.clock = BootClock("boot", self.time)
        self.delay_s = delay_s
        self.said: list[tuple[Channel, Message]] = []
        self.plan_requests: list[PlanRequest] = []
        self.written: list[dict[str, Any]] = []
        if embodiment is None:
            embodiment = self._point(task, plant)
        self.plant, self.dt_s = embodiment.hardware.plant, 1.0 / embodiment.hardware.control_hz
        self.robot = Supervisor(
            TaskSet([task, *also]), RemoteConfig(), embodiment, self.clock,
            lambda channel, message: self.said.append((channel, message)), self.plan_requests.append,
            lambda **fields: self.written.append(fields),
        )  # fmt: skip
        self.lease_id = ""
        self._count = self._ticks = 0

    def _point(self, task: AnyTask, plant: PointPlant | None) -> Embodiment:
        assert isinstance(task, PointTask)
        plant = plant or PushedPlant(task)
        self.sight = Sight(task)
        return point_embodiment(task, plant, self.sight)

    @property
    def mode(self) -> ControlMode:
        return self.robot.mode

    @property
    def position_m(self) -> np.ndarray:
        return self.plant.read().position_m

    @property
    def speed_m_s(self) -> float:
        return float(np.linalg.norm(self.plant.read().velocity_m_s))

    def heard(self, kind: type[M]) -> list[M]:
        """Everything of one kind that the robot said."""
        return [message for _, message in self.said if isinstance(message, kind)]

    def ending(self, command_id: str) -> Event | None:
        """The second answer to a command."""
        answers = [e for e in self.heard(Event) if e.command_id == command_id]
        return next((e for e in answers if e.kind in ("completed", "failed")), None)

    def events(self, kind: str) -> list[Event]:
        """What the robot told of one kind."""
        return [event for event in self.heard(Event) if event.kind == kind]

    # The operator -------------------------------------------------------------------------------

    def echo(self) -> Stamp:
        """The newest report that the operator had seen when what arrives now was sent."""
        return Stamp(self.clock.boot, self.time.ns - round(self.delay_s * 1e9))

    def ask_lease(
        self, session: str = "session", name: str = "ann", wish: Wish = Wish.CONTROL
    ) -> LeaseReply:  # fmt: skip
        request = LeaseRequest(session=session, site_name=name, wish=wish, echo=self.echo())
        reply = self.robot.on_lease(request)
        if reply.granted and session == "session":
            self.lease_id = reply.lease_id
        return reply

    def command(self, action: Action, **fields: Any) -> CommandReply:
        """Give a command, as it should be but for the fields that are named."""
        self._count += 1
        usual = {
            "command_id": f"command {self._count}", "session": "session", "lease_id": self.lease_id,
            "action": action, "echo": self.echo(), "task": self.task.name,
        }  # fmt: skip
        return self.robot.on_command(Command(**(usual | fields)))

    def stop(self, stop_id: str = "stop") -> None:
        self.robot.on_stop(Stop(stop_id=stop_id, site_name="bob"))

    def send_model(self, sent: ModelTransfer | None = None) -> ModelReply:
        taken = self.robot.reception.take(structs.replace(sent or transfer(), session="session"))
        return (
            self.robot.reception.finish_trial(taken, taken.outcome())
            if isinstance(taken, ModelTrial)
            else taken
        )

    def hand(self, *position_m: float, **fields: Any) -> None:
        """The operator's hand is at a place on their own board, or before their own arm."""
        self._count += 1
        coupling = self.robot.motion.coupling
        usual = {
            "seq": self._count, "echo": self.echo(), "lease_id": self.lease_id,
            "coupling_id": coupling.coupling_id if coupling else 0, "position_m": position_m,
        }  # fmt: skip
        self.robot.on_input(OperatorInput(**(usual | fields)))

    # Time ---------------------------------------------------------------------------------------

    def run(self, duration_s: float, present: bool = True) -> None:
        """Let the control loop run, with or without an operator who says that they are there."""
        for _ in range(round(duration_s / self.dt_s)):
            self.time.advance(self.dt_s)
            self._ticks += 1
            if present and self._ticks % round(_HEARTBEAT_S / self.dt_s) == 0:
                alive = Heartbeat(session="session", seq=self._ticks, echo=self.echo())
                self.robot.contact.heartbeat(alive)
            if present and self._ticks % round(_RENEWAL_S / self.dt_s) == 0 and self.lease_id:
                self.ask_lease()
            self.robot.tick(self.dt_s)

    def drive(self, duration_s: float, x: float, y: float = 0.0, *z: float, **fields: Any) -> None:
        """Hold the hand at a place, as a hand does: an event in every control period."""
        for _ in range(round(duration_s / self.dt_s)):
            self.hand(x, y, *z, **fields)
            self.run(self.dt_s)

    # Where tests begin --------------------------------------------------------------------------

    def armed(self) -> Self:
        assert self.ask_lease().granted
        assert self.command(Action.ARM).accepted
        self.run(0.1)
        return self

    def coupled(self) -> Self:
        self.armed()
        assert self.command(Action.COUPLE).accepted
        return self

    def executing(self) -> Self:
        self.armed()
        reply = self.send_model()
        assert self.command(Action.EXECUTE, model_sha256=reply.sha256).accepted
        self.run(0.5)
        return self

    def arrived(self) -> Self:
        self.executing()
        for _ in range(30):
            if self.robot.phase is Phase.ARRIVED:
                return self
            self.run(0.5)
        raise AssertionError("it never arrived")

    def paused(self) -> Self:
        self.executing()
        assert self.command(Action.PAUSE).accepted
        return self

    def stopped(self) -> Self:
        self.armed()
        self.stop()
        self.run(0.1)
        return self

    def preview(self, sha256: str) -> int:
        """Preview, and have the worker's rollout come back. Returns the plan's id."""
        reply = self.command(Action.PREVIEW, model_sha256=sha256)
        assert reply.accepted, reply.reason
        request = self.plan_requests[-1]
        self.robot.on_path(request, *answer(request))
        return request.plan_id


BEGINNINGS = {
    ControlMode.DISARMED: lambda bench: bench,
    ControlMode.HOLD: Bench.armed,
    ControlMode.DIRECT: Bench.coupled,
    ControlMode.AUTONOMOUS: Bench.executing,
    ControlMode.PAUSED: Bench.paused,
    ControlMode.STOPPED: Bench.stopped,
}
"""How a fresh bench comes into each mode."""


def in_mode(mode: ControlMode) -> Bench:
    """A fresh bench in some mode."""
    bench = Bench()
    BEGINNINGS[mode](bench)
    assert bench.mode is mode
    return bench
