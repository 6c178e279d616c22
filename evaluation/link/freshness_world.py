"""Shipped supervisor, an operator who drives it, and the line between them, in virtual time.

Every input that arrives, late, twice or in time, is given to the supervisor and to the common stamp rule, its
peer: the receiver's clock minus the sender's stamp (MoveIt Servo: stale above 0.1 s; dimos: 0.5 s), together
with the newest sequence number. That rule is right as long as the two clocks agree.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any

import numpy as np

from farhand.common.clock import BootClock
from farhand.common.impairment.delay_line import DelayLine
from farhand.common.impairment.impairment import DirectionSettings
from farhand.common.mode_table import Action, ControlMode
from farhand.common.task import PointTask, Target, TaskSet
from farhand.common.wire.messages import Command, Heartbeat, LeaseRequest, OperatorInput, Stamp
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.plant import PointPlant
from farhand.remote_site.perception.simulated_sight import OscillatingTarget, SimulatedPerception
from farhand.remote_site.robots.point_embodiment import point_embodiment
from farhand.remote_site.supervision.supervisor import Supervisor

DT_S = 0.02
TELEMETRY_S = 0.04
JITTER_S = 0.02
_HEARTBEAT_TICKS, _RENEWAL_TICKS, _COUPLE_TICKS = 5, 50, 25

_TASK = PointTask(
    name="freshness", n_dims=2, frame_names=("goal",), workspace_m=(1.0, 1.0), start_m=(0.5, 0.5),
    target=Target(origin_m=(0.5, 0.5), amplitude_m=(0.0, 0.0)),
)  # fmt: skip


@dataclass(frozen=True)
class MessageArrival:
    """Operator's input at the robot.

    Args:
        message: The input.
        sent_s: True time of sending [s].
        now_s: Time of arrival [s].
        age_shown_s: Age of the echoed report at the time of sending [s].
        current: Whether it names the present boot, lease and coupling of the robot.
        counted: Whether the supervisor let it move the robot.
    """

    message: OperatorInput
    sent_s: float
    now_s: float
    age_shown_s: float
    current: bool
    counted: bool


@dataclass(frozen=True)
class Report:
    """Report of the robot as the operator sees it."""

    stamp: Stamp
    made_s: float
    mode: ControlMode
    coupling_id: int


class DelayedLine:
    """One direction of the line: delivers in order, and runs each item's action at the other end."""

    def __init__(self, delay_s: float, seed: int):
        settings = DirectionSettings(delay_ms=1e3 * delay_s, jitter_ms=1e3 * JITTER_S, seed=seed)
        self.line = DelayLine(settings)
        self._things: deque[Callable[[], None]] = deque()

    def send(self, now_s: float, arrive: Callable[[], None]) -> None:
        """Put an item on the line."""
        self.line.push(now_s, 100)
        self._things.append(arrive)

    def deliver(self, now_s: float) -> None:
        """Deliver the messages that are due."""
        while self.line.next_due_s is not None and self.line.next_due_s <= now_s:
            self.line.pop()
            self._things.popleft()()


class DrivingWorld:
    """Robot, operator, and the lines there and back.

    Args:
        delay_s: One-way delay [s].
        seed: Seed of the jitter.
        on_arrival: Called with every input that arrives.
    """

    def __init__(self, delay_s: float, seed: int, on_arrival: Callable[[MessageArrival], None]):
        self.now_s, self._tick, self._boots = 100.0, 0, 0
        self._on_arrival = on_arrival
        self.up, self.down = DelayedLine(delay_s, 2 * seed), DelayedLine(delay_s, 2 * seed + 1)
        self._plant = PointPlant(np.array(_TASK.start_m), np.ones(2), 0.6, 4.0)
        self.shown: Report | None = None
        self.lease_id = ""
        self._seq = 0
        self.sent: deque[tuple[OperatorInput, float, float]] = deque(maxlen=2000)
        """Inputs that went over the line, which somebody may have recorded."""
        self.robot = self._boot()

    def restart(self) -> None:
        """Restart the robot's process."""
        self.robot = self._boot()

    def step(self) -> None:
        """Run one control period."""
        self.now_s += DT_S
        self._tick += 1
        self.up.deliver(self.now_s)
        self.robot.tick(DT_S)
        if self._tick % round(TELEMETRY_S / DT_S) == 0:
            coupling = self.robot.motion.coupling
            report = Report(
                self.robot.stamp(), self.now_s, self.robot.mode, coupling.coupling_id if coupling else 0
            )
            self.down.send(self.now_s, lambda: self._show(report))
        self.down.deliver(self.now_s)
        self._operate()

    def arrive(self, message: OperatorInput, sent_s: float, age_shown_s: float) -> None:
        """Deliver an input to the robot, for the first time or again."""
        coupling = self.robot.motion.coupling
        newest = coupling.newest_seq if coupling else None
        current = coupling is not None and (message.echo.boot, message.lease_id, message.coupling_id) == (
            self._clock.boot, coupling.lease_id, coupling.coupling_id,
        )  # fmt: skip
        self.robot.on_input(message)
        counted = coupling is not None and coupling.newest_seq != newest
        self._on_arrival(MessageArrival(message, sent_s, self.now_s, age_shown_s, current, counted))

    # The operator -------------------------------------------------------------------------------

    def _show(self, report: Report) -> None:
        self.shown = report

    def _operate(self) -> None:
        echo = self.shown.stamp if self.shown else None
        if self._tick % _RENEWAL_TICKS == 0:
            request = LeaseRequest(session="s", site_name="ann", echo=echo)
            self._send(lambda: self._renewed(self.robot.on_lease(request).lease_id))
        if self._tick % _HEARTBEAT_TICKS == 0:
            alive = Heartbeat(session="s", seq=self._tick, echo=echo)
            self._send(lambda: self.robot.contact.heartbeat(alive))
        if self.shown is None or echo is None:
            return
        if self.shown.coupling_id:
            self._seq += 1
            x = 0.5 + 0.2 * np.sin(self._seq * DT_S)
            message = OperatorInput(
                seq=self._seq, echo=echo, lease_id=self.lease_id, coupling_id=self.shown.coupling_id,
                position_m=(float(x), 0.5),
            )  # fmt: skip
            sent = (message, self.now_s, self.now_s - self.shown.made_s)
            self.sent.append(sent)
            self._send(lambda: self.arrive(*sent))
        elif self._tick % _COUPLE_TICKS == 0:
            action = Action.ARM if self.shown.mode is ControlMode.DISARMED else Action.COUPLE
            command = Command(
                command_id=f"{self._boots} {self._tick}", session="s", lease_id=self.lease_id, action=action,
                echo=echo, task=_TASK.name,
            )  # fmt: skip
            self._send(lambda: self.robot.on_command(command) and None)

    def _renewed(self, lease_id: str) -> None:
        def told() -> None:
            self.lease_id = lease_id or self.lease_id

        self.down.send(self.now_s, told)

    def _send(self, arrive: Callable[[], None]) -> None:
        self.up.send(self.now_s, arrive)

    def _boot(self) -> Supervisor:
        self._boots += 1
        self._clock = BootClock(f"boot {self._boots}", lambda: round(self.now_s * 1e9))
        sight = SimulatedPerception.of_oscillating(OscillatingTarget(_TASK.target), 0.0, 0)
        return Supervisor(
            TaskSet([_TASK]),
            RemoteConfig(),
            point_embodiment(_TASK, self._plant, sight),
            self._clock,
            _nowhere,
            _nowhere,
            _nowhere,
        )


def a_stall(random: Random, first_s: float, last_s: float) -> tuple[float, float]:
    """Draw beginning and end of an outage in which everything waits [s]."""
    begins_s = random.uniform(first_s, last_s)
    return begins_s, begins_s + random.uniform(2.0, 8.0)


def _nowhere(*_: Any, **__: Any) -> None:
    """Do nothing: nobody listens, plans or writes."""


class StampRule:
    """Rule that judges by two wall clocks.

    Args:
        ttl_s: Largest age of a message [s].
    """

    def __init__(self, ttl_s: float):
        self._ttl_s = ttl_s
        self._newest_seq = -1

    def restart(self) -> None:
        """Restart the receiver, which forgets everything."""
        self._newest_seq = -1

    def accepts(self, seq: int, stamp_s: float, now_s: float) -> bool:
        """Decide whether a message is fresh.

        Args:
            seq: Sequence number of the message.
            stamp_s: Time of sending, on the sender's wall clock [s].
            now_s: Present time on the receiver's wall clock [s].
        """
        if seq <= self._newest_seq or now_s - stamp_s > self._ttl_s:
            return False
        self._newest_seq = seq
        return True
