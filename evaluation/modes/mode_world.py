"""Shipped supervisor with its surroundings, all of it copyable, in virtual time.

The world of the exhaustive check: its surroundings, operators whose every message is made here, and a network
that keeps old messages to deliver them once more.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from farhand.common.clock import BootClock
from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.task import TaskSet
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import (
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
from farhand.evaluation.harness.steered_world import PushedPlant, SteeredSight, SteppedTime
from farhand.evaluation.modes.mode_surroundings import (
    CONFIG,
    DT_S,
    TASK,
    good_model,
    target_frame,
)
from farhand.remote_site.motion.model_trial import ModelTrial
from farhand.remote_site.motion.preview_worker import PlanRequest
from farhand.remote_site.robots.point_embodiment import point_embodiment
from farhand.remote_site.supervision.supervisor import Supervisor

ROUND_TRIP_S = 0.1
_HEARTBEAT_TICKS, _RENEWAL_TICKS = 2, 20


@dataclass
class SimulatedOperator:
    """Local site, as far as the robot hears of it.

    Args:
        name: Name and session of the site.
        lease_id: Lease that it holds, or once held.
        coupling_id: Coupling that it was told last.
        present: Whether it sends heartbeats and renewals.
        last: Its last command, for a network that delivers it again.
        plan_id: Plan that it was shown last.
    """

    name: str
    lease_id: str = ""
    coupling_id: int = 0
    present: bool = True
    last: Command | None = None
    plan_id: int = 0


class ModeWorld:
    """Robot, its surroundings and its operators.

    Args:
        n_operators: Number of operators.
    """

    def __init__(self, n_operators: int):
        self.operators = [SimulatedOperator(name) for name in ("ann", "bob")[:n_operators]]
        self.plant = PushedPlant(TASK)
        self.sight = SteeredSight(target_frame)
        self.n_boots = 0
        self.counter = 0
        self._boot()

    def _boot(self) -> None:
        self.n_boots += 1
        # The clock of a new boot starts from zero: only its name distinguishes an old stamp from a new one.
        self.source = SteppedTime()
        self.clock = BootClock(f"boot {self.n_boots}", self.source)
        self.said: list[Message] = []
        self.plan_request: PlanRequest | None = None
        embodiment = point_embodiment(TASK, self.plant, self.sight, 1.0 / DT_S)
        self.robot = Supervisor(
            TaskSet([TASK]), CONFIG, embodiment, self.clock, self._hear, self._take_plan, _forget
        )  # fmt: skip

    def restart(self) -> None:
        """Restart the remote process; the plant stays where it stopped."""
        position = self.plant.read().position_m
        self.plant = PushedPlant(TASK, position)
        self._boot()

    def copy(self) -> ModeWorld:
        """Return an equal world; what never changes is shared."""
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
        """Return the stamp that a message of this age echoes."""
        return Stamp(self.clock.boot, max(0, self.source.ns - round(age_s * 1e9)))

    # What operators send ------------------------------------------------------------------------

    def ask_lease(self, operator: SimulatedOperator, wish: Wish = Wish.CONTROL) -> None:
        """Send a lease renewal or request."""
        request = LeaseRequest(session=operator.name, site_name=operator.name, wish=wish, echo=self.echo())
        reply = self.robot.on_lease(request)
        operator.lease_id = reply.lease_id if reply.granted else operator.lease_id

    def command(self, operator: SimulatedOperator, action: Action, **changes: Any) -> CommandReply:
        """Send a fresh command of an operator, with the given changes."""
        self.counter += 1
        command = Command(
            command_id=f"{operator.name} {self.n_boots} {self.counter}", session=operator.name,
            lease_id=operator.lease_id, action=action, echo=self.echo(), task=TASK.name,
            model_sha256=good_model().sha256, plan_id=operator.plan_id,
        )  # fmt: skip
        command = msgspec.structs.replace(command, **changes)
        operator.last = command
        return self.robot.on_command(command)

    def hand(
        self, operator: SimulatedOperator, age_s: float = ROUND_TRIP_S, coupling_id: int | None = None
    ) -> None:
        """Send one input of an operator's hand, away from the target."""
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

    def send_model(self, transfer: ModelTransfer) -> None:
        """Deliver a model from the site in control."""
        transfer = msgspec.structs.replace(transfer, session=self.robot.contact.lease.session)
        taken = self.robot.reception.take(transfer)
        if isinstance(taken, ModelTrial):
            self.robot.reception.finish_trial(taken, taken.outcome())

    def stop(self, operator: SimulatedOperator) -> None:
        """Send a stop."""
        self.counter += 1
        self.robot.on_stop(Stop(stop_id=f"stop {self.counter}", site_name=operator.name))

    def finish_plan(self) -> None:
        """Finish the plan that was requested last."""
        request, self.plan_request = self.plan_request, None
        if request is None:
            return
        points = np.zeros((2, 2), dtype="<f4").tobytes()
        path = PlannedPath(
            path_id=request.path_id, plan_id=request.plan_id, stamp=request.stamp, n_coordinates=2, step_s=0.1,
            model_sha256=request.stored.sha256, points=points, reaches_end=True,
        )  # fmt: skip
        self.robot.on_path(request, path, None)
        for operator in self.operators:
            operator.plan_id = request.plan_id

    # Time ---------------------------------------------------------------------------------------

    def run(self, duration_s: float, late_s: float = 0.0) -> None:
        """Advance the time; present operators send heartbeats and renewals."""
        for tick in range(max(1, round(duration_s / DT_S))):
            self.source.advance(DT_S)
            for operator in self.operators:
                if operator.present and tick % _HEARTBEAT_TICKS == 0:
                    self.counter += 1
                    alive = Heartbeat(session=operator.name, seq=self.counter, echo=self.echo())
                    self.robot.contact.heartbeat(alive)
                if operator.present and tick % _RENEWAL_TICKS == _RENEWAL_TICKS - 1:
                    self.ask_lease_if_held(operator)
            self.robot.tick(DT_S, late_s)

    def ask_lease_if_held(self, operator: SimulatedOperator) -> None:
        """Renew the lease of an operator that holds one."""
        if self.robot.contact.lease.holder == operator.name:
            self.ask_lease(operator)

    def run_to_the_end(self) -> None:
        """Run to the end of an execution or of a manoeuvre."""
        self.run(DT_S)
        for _ in range(100):
            if self.robot.mode is not ControlMode.AUTONOMOUS or self.robot.phase.at_end:
                return
            self.run(0.2)

    @property
    def speed_m_s(self) -> float:
        """Speed of the effector [m/s]."""
        return float(np.linalg.norm(self.plant.read().velocity_m_s))

    @property
    def phase(self) -> Phase:
        """Phase of the robot."""
        return self.robot.phase


def _forget(**_fields: Any) -> None:
    """Drop an event: nobody reads the event log of a world."""
