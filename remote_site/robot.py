"""The robot behind its link, one control period at a time: no thread, no file, no transport of its own.

`RemoteSite` gives it those; in virtual time whoever moves the time calls `step`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from common import keys
from common.budget import limit_flows
from common.clock import BootClock
from common.codec import decode, encode
from common.errors import InvalidMessage
from common.keys import Channel
from common.link import Link, Request
from common.log import loop_logger
from common.mailbox import Mailbox
from common.messages import (
    Command,
    EventsRequest,
    ExecutionReport,
    Heartbeat,
    LeaseRequest,
    Message,
    ModelTransfer,
    MoveTarget,
    OperatorInput,
    PlannedPath,
    ReportRequest,
    Stop,
)
from common.task import PointTask
from remote_site.config import RemoteConfig
from remote_site.perception import OscillatingTarget, SimulatedPerception
from remote_site.planner import PlanRequest
from remote_site.plant import PointPlant
from remote_site.plant_memory import PlantState
from remote_site.supervisor import Supervisor
from remote_site.telemetry import Reporter

_log = loop_logger(__name__)

_MOST_PER_TICK = 256


class Robot:
    """One robot behind a link.

    Messages are decoded in the link's threads and handled between two ticks, so that the supervisor has one
    owner: whoever calls `step`.

    Args:
        config: Rates, limits.
        task: What the robot does.
        clock: Its time.
        link: To the operators.
        request_plan: Hands a rollout to a worker, which answers with `take_path`; never blocks.
        write: Keeps an event; never blocks.
        remembered: Where the robot was in its last boot, None for its first.
    """

    def __init__(
        self,
        config: RemoteConfig,
        task: PointTask,
        clock: BootClock,
        link: Link,
        request_plan: Callable[[PlanRequest], None],
        write: Callable[..., Any],
        remembered: PlantState | None,
    ):
        self._config, self._task, self._clock, self._link = config, task, clock, link
        self._inbox: Mailbox[Callable[[], None]] = Mailbox(_MOST_PER_TICK)
        # A flood of other messages must push out neither a stop nor the answer to a preview.
        self._first: Mailbox[Callable[[], None]] = Mailbox(_MOST_PER_TICK)
        self._ticks = 0
        self.overruns = 0
        """Control periods that came too late, as `RemoteSite` counts them."""
        self.supervisor = self._make_supervisor(request_plan, write, remembered)
        self._reporter = Reporter(self.supervisor, clock)
        self._listen()

    def step(self, late_s: float = 0.0) -> None:
        """One control period: do what has arrived, move, report.

        Args:
            late_s: How late it began [s].
        """
        self.handle()
        self.move(late_s)

    def handle(self) -> None:
        """Do what has arrived."""
        for handle in self._first.take_all() + self._inbox.take_all():
            handle()

    def move(self, late_s: float = 0.0) -> None:
        """Watch, move, report."""
        self.supervisor.tick(1.0 / self._config.control_hz, late_s)
        if self._ticks % max(1, round(self._config.control_hz / self._config.telemetry_hz)) == 0:
            self._announce(keys.TELEMETRY, self._reporter.report())
        self._ticks += 1

    def take_path(self, request: PlanRequest, path: PlannedPath | None, problem: str) -> None:
        """A rollout is ready, or there is a reason why not; from any thread."""
        self._first.put(partial(self.supervisor.on_path, request, path, problem))

    def _make_supervisor(
        self,
        request_plan: Callable[[PlanRequest], None],
        write: Callable[..., Any],
        remembered: PlantState | None,
    ) -> Supervisor:
        task, target = self._task, self._task.target
        phase = float(np.random.default_rng(self._config.seed).uniform(0.0, 2.0 * np.pi))
        self._target = OscillatingTarget(target, phase)
        perception = SimulatedPerception.of_oscillating(self._target, target.noise_std_m, self._config.seed)
        limits = task.limits
        start_m = np.clip(remembered.position_m if remembered else task.start_m, 0.0, task.workspace_m)
        plant = self.plant = PointPlant(
            start_m, np.array(task.workspace_m), limits.speed_m_s, limits.acceleration_m_s2
        )
        supervisor = Supervisor(
            task, self._config, plant, perception, self._clock, self._announce, request_plan, write
        )
        if remembered is not None and remembered.executing:
            why = f"the execution of {remembered.executing[:8]} was interrupted by a restart of the robot"
            supervisor.machine.tell("interrupted", why, succeeded=False)
        return supervisor

    def _announce(self, channel: Channel, message: Message) -> None:
        self._link.send(channel, encode(message))

    # Receiving ----------------------------------------------------------------------------------

    def _listen(self) -> None:
        supervisor = self.supervisor
        limit_flows(self._link, self._config.link.rate_bps)
        for channel, kind, handle in (
            (keys.STOP, Stop, supervisor.on_stop),
            (keys.INPUT, OperatorInput, supervisor.on_input),
            (keys.HEARTBEAT, Heartbeat, supervisor.contact.heartbeat),
            (keys.TARGET, MoveTarget, self._on_move_target),
        ):
            self._link.subscribe(channel, partial(self._on_message, kind, handle))
        for channel, kind, handle in (
            (keys.COMMAND, Command, supervisor.on_command),
            (keys.LEASE, LeaseRequest, supervisor.on_lease),
            (keys.MODEL, ModelTransfer, supervisor.on_model),
            (keys.REPORT, ReportRequest, self._on_report),
            (keys.EVENTS, EventsRequest, supervisor.on_events),
        ):
            self._link.serve(channel, partial(self._on_request, kind, handle))

    def _on_message(self, kind: type[Message], handle: Callable[..., None], data: bytes) -> None:
        try:
            message = decode(data, kind)
        except InvalidMessage as error:
            _log.warning("dropped: %s", error)
        else:
            (self._first if kind is Stop else self._inbox).put(partial(handle, message))

    def _on_request(self, kind: type[Message], handle: Callable[..., Message], request: Request) -> None:
        try:
            message = decode(request.data, kind)
        except InvalidMessage as error:
            # No answer: to the asker this is a request that was not delivered.
            _log.warning("not answered: %s", error)
        else:
            self._inbox.put(lambda: request.answer(encode(handle(message))))

    def _on_move_target(self, message: MoveTarget) -> None:
        """The simulated target is dragged by whoever holds the lease; it stays in the workspace."""
        lease = self.supervisor.contact.lease
        if not lease.lease_id or message.lease_id != lease.lease_id:
            return
        if len(message.position_m) == self._task.n_dims:
            mean_m = np.clip(message.position_m, 0.0, self._task.workspace_m)
            self._target.move_to(mean_m, self._clock.now_s())

    def _on_report(self, _request: ReportRequest) -> ExecutionReport:
        now, last = self.supervisor.stamp(), self.supervisor.last_execution
        return last.report(now, self.overruns) if last else ExecutionReport(stamp=now)
