"""The remote process: link, supervisor, control loop."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from common import keys
from common.clock import BootClock, Rate
from common.codec import decode, encode
from common.errors import InvalidMessage
from common.event_log import EventLog
from common.keys import Channel
from common.link import Request, ZenohLink
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
    ReportRequest,
    Stop,
)
from common.task import Task
from remote_site.config import RemoteConfig
from remote_site.perception import OscillatingTarget, SimulatedPerception
from remote_site.planner import Planner
from remote_site.plant import PointPlant
from remote_site.plant_memory import PERIOD_S, PlantMemory, PlantState
from remote_site.reproduction.executor import warm_up
from remote_site.supervisor import Supervisor
from remote_site.telemetry import Reporter

_log = loop_logger(__name__)

_MOST_PER_TICK = 256


class RemoteSite:
    """One robot behind a link.

    Messages are decoded in the link's threads and handled by the control loop between two ticks, so
    that the supervisor has one owner.

    Args:
        config: Endpoints, rates, limits.
        task: What the robot does.
        data_dir: Where its events and the state of the simulated robot are kept.
    """

    def __init__(self, config: RemoteConfig, task: Task, data_dir: Path):
        self._config, self._task = config, task
        self._data_dir = data_dir / "robot" / config.link.vehicle
        self._stop = threading.Event()
        self._inbox: Mailbox[Callable[[], None]] = Mailbox(_MOST_PER_TICK)
        # A flood of other messages must push out neither a stop nor the answer to a preview.
        self._first: Mailbox[Callable[[], None]] = Mailbox(_MOST_PER_TICK)
        self._clock = BootClock()

    def stop(self) -> None:
        """Ask the loop to end; safe in a signal handler."""
        self._stop.set()

    def run(self, ready: Callable[[], None]) -> None:
        """Serve until stopped.

        Args:
            ready: Called once the endpoint is open, the kernels are compiled and the loop is about to run.

        Raises:
            LinkError: When the endpoint cannot be opened.
        """
        # The planner and the link's threads must not hold up a control tick.
        sys.setswitchinterval(5e-4)
        warm_up(self._task.n_dims)
        self._link = ZenohLink(self._config.link)
        self._memory = PlantMemory(self._data_dir / "state.json")
        self._event_log = EventLog(self._data_dir / "events.jsonl")
        planner = Planner(lambda *result: self._first.put(partial(self._supervisor.on_path, *result)))
        try:
            self._supervisor = self._make_supervisor(planner)
            self._listen()
            _log.info("the robot is ready: %s", self._config.link.listen)
            ready()
            self._loop()
        finally:
            planner.close()
            self._link.close()
            self._memory.close()
            self._event_log.close()

    def _make_supervisor(self, planner: Planner) -> Supervisor:
        task, target = self._task, self._task.target
        phase = float(np.random.default_rng(self._config.seed).uniform(0.0, 2.0 * np.pi))
        perception = self._perception = SimulatedPerception(
            OscillatingTarget(target, phase), target.noise_std_m, self._config.seed
        )
        limits, remembered = task.limits, self._memory.load(task.n_dims)
        start_m = np.clip(remembered.position_m if remembered else task.start_m, 0.0, task.workspace_m)
        plant = PointPlant(start_m, np.array(task.workspace_m), limits.speed_m_s, limits.acceleration_m_s2)
        supervisor = Supervisor(
            task, self._config, plant, perception, self._clock, self._announce, planner.request,
            self._event_log.append,
        )  # fmt: skip
        if remembered is not None and remembered.executing:
            why = f"the execution of {remembered.executing[:8]} was interrupted by a restart of the robot"
            supervisor.machine.tell("interrupted", why, succeeded=False)
        return supervisor

    def _announce(self, channel: Channel, message: Message) -> None:
        self._link.send(channel, encode(message))

    # Receiving ----------------------------------------------------------------------------------

    def _listen(self) -> None:
        supervisor = self._supervisor
        self._link.limit(keys.TELEMETRY, self._config.telemetry_budget_bytes_s)
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
        lease = self._supervisor.contact.lease
        if not lease.lease_id or message.lease_id != lease.lease_id:
            return
        if len(message.position_m) == self._task.n_dims:
            mean_m = np.clip(message.position_m, 0.0, self._task.workspace_m)
            self._perception.move_to(mean_m, self._clock.now_s())

    def _on_report(self, _request: ReportRequest) -> ExecutionReport:
        now, last = self._supervisor.stamp(), self._supervisor.last_execution
        return last.report(now, self._rate.overruns) if last else ExecutionReport(stamp=now)

    # The control loop ---------------------------------------------------------------------------

    def _loop(self) -> None:
        period_s = 1.0 / self._config.control_hz
        every = max(1, round(self._config.control_hz / self._config.telemetry_hz))
        remember_every = max(1, round(PERIOD_S * self._config.control_hz))
        reporter = Reporter(self._supervisor, self._clock)
        self._rate = Rate(period_s, self._stop)
        tick = 0
        while self._rate.wait():
            for handle in self._first.take_all() + self._inbox.take_all():
                handle()
            self._supervisor.tick(period_s, self._rate.late_s)
            if tick % every == 0:
                self._announce(keys.TELEMETRY, reporter.report())
            if tick % remember_every == 0:
                self._memory.remember(PlantState.of(self._supervisor.sensing, self._supervisor.motion))
            tick += 1
