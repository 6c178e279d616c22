"""Robot behind its link, one control period at a time, without a thread, file or transport of its own.

`RemoteSite` provides these; in virtual time whoever advances the time calls `step`.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from farhand.common.arm.cell import Cell
from farhand.common.clock import BootClock
from farhand.common.errors import InvalidMessage
from farhand.common.link.budget import limit_flows, part_bytes
from farhand.common.link.interface import Link, Request, site_of
from farhand.common.log import loop_logger
from farhand.common.task import TaskSet
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import (
    BlobReply,
    BlobRequest,
    CatalogueReply,
    CatalogueRequest,
    Command,
    EventKind,
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
    Telemetry,
)
from farhand.common.wire.motion_encoding import thinned
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.motion.model_trial import ModelTrial, Outcome, TryModel, try_at_once
from farhand.remote_site.motion.preview_worker import PlanRequest
from farhand.remote_site.robots.embodiments import embodiment_of
from farhand.remote_site.robots.plant_memory import PlantState
from farhand.remote_site.supervision.inbox import Inbox
from farhand.remote_site.supervision.supervisor import Supervisor
from farhand.remote_site.telemetry import Reporter

_log = loop_logger(__name__)
_refused_log = logging.getLogger(
    f"{__name__}.refused"
)  # not limited: `refusals.py` tells no reason too often

Observe = Callable[[Telemetry, NDArray[np.float64] | None], None]


class Robot:
    """Robot behind a link.

    The link's threads decode messages, which are handled between two ticks, so that the supervisor has one
    owner: the caller of `step`.

    Args:
        config: Rates and limits.
        tasks: Tasks of the robot.
        clock: Clock of the robot.
        link: Link to the operators.
        request_plan: Hands a rollout to a worker, which answers with `take_path`; never blocks.
        write: Writes an event to disk; never blocks.
        remembered: State in its last boot, None in its first.
        embodiment: Embodiment; the simulated robot of the first task when not given.
        try_model: Hands a received model to a worker, which answers; never blocks. Without it the model is
            tried at once, as suits virtual time.
        cell: Arm in front of its receptacle, for the tasks of an arm.
        observe: Takes each report, with the true pose of a simulated receptacle; never blocks.
    """

    def __init__(
        self,
        config: RemoteConfig,
        tasks: TaskSet,
        clock: BootClock,
        link: Link,
        request_plan: Callable[[PlanRequest], None],
        write: Callable[..., Any],
        remembered: PlantState | None,
        embodiment: Embodiment | None = None,
        try_model: TryModel = try_at_once,
        cell: Cell | None = None,
        observe: Observe = lambda _report, _receptacle: None,
    ):
        self._observe = observe
        self._try_model = try_model
        self._config, self._n_dims, self._link = config, tasks.first.space.n_dims, link
        self._ticks = 0
        self.overruns = 0
        """Control periods that came too late, as counted by `RemoteSite`."""
        self.embodiment = embodiment or embodiment_of(tasks.first, config, clock, remembered, cell)
        """Embodiment, with its control rate."""
        self.supervisor = Supervisor(
            tasks, config, self.embodiment, clock, self._announce, request_plan, write
        )
        if remembered is not None and remembered.executing:
            why = because(Code.INTERRUPTED, model=remembered.executing[:8])
            self.supervisor.machine.tell(EventKind.INTERRUPTED, why, succeeded=False)
        if scene := self.embodiment.hardware.scene():
            self.supervisor.recordings.catalogue.show(scene, self.embodiment.hardware.sketch())
        self._reporter = Reporter(self.supervisor, clock)
        self._inbox = Inbox(self.supervisor.contact.lease)
        self._listen()

    def step(self, late_s: float = 0.0) -> None:
        """Run one control period: handle the arrived messages, move, report.

        Args:
            late_s: Lateness of its beginning [s].
        """
        self.handle()
        self.move(late_s)

    @property
    def waiting(self) -> int:
        """Number of messages that wait for the next control period."""
        return len(self._inbox)

    def handle(self) -> None:
        """Handle arrived messages, as many as a control period has time for."""
        for handle in self._inbox.take():
            self.supervisor.failsafe.run(handle)

    def move(self, late_s: float = 0.0) -> None:
        """Guard, move, report."""
        control_hz = self.embodiment.hardware.control_hz
        self.supervisor.tick(1.0 / control_hz, late_s)
        if self._ticks % max(1, round(control_hz / self._config.telemetry_hz)) == 0:
            self.supervisor.failsafe.run(self._tell_state)
        self._ticks += 1

    def take_path(self, request: PlanRequest, path: PlannedPath | None, note: Reason | None) -> None:
        """Take a rollout, or the reason why there is none (see `preview_worker.py`); from any thread."""
        if path is not None:  # it would delay the reports on a narrow link for seconds
            path = thinned(path, part_bytes(self._config.link.rate_bps))
        self._inbox.put_own(partial(self.supervisor.on_path, request, path, note))

    def _tell_state(self) -> None:
        report = self._reporter.report(self.overruns)
        self._announce(keys.TELEMETRY, report)
        self._observe(report, self.embodiment.world.receptacle())

    def tell_refused(self, words: str) -> None:
        """Tell that the link dropped a listener, or refused somebody; from any thread."""
        _refused_log.warning(words)
        why = because(Code.LISTENER_DROPPED, text=words)
        tell = self.supervisor.machine.tell
        self._inbox.put_own(partial(tell, EventKind.DROPPED, why, succeeded=False, who="the link"))

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
            (keys.REPORT, ReportRequest, self._on_report),
            (keys.EVENTS, EventsRequest, supervisor.events.answer),
            (keys.CATALOGUE, CatalogueRequest, self._on_catalogue),
            (keys.BLOB, BlobRequest, self._on_blob),
        ):
            self._link.serve(channel, partial(self._on_request, kind, partial(self._answer, handle)))
        self._link.serve(keys.LEASE, partial(self._on_request, LeaseRequest, self._on_lease))
        self._link.serve(keys.MODEL, partial(self._on_request, ModelTransfer, self._on_model))

    def _on_message(self, kind: type[Message], handle: Callable[..., None], data: bytes) -> bool:
        """Judge a message, and return whether its sender may go on at once; from any thread."""
        message = self._understood(data, kind, "dropped")
        if isinstance(message, Stop) and (site := site_of(data)):
            message = structs.replace(message, site_name=site)  # whatever it calls itself
        return message is not None and self._inbox.put(message, partial(handle, message))

    def _on_request(
        self, kind: type[Message], handle: Callable[[Any, Request], None], request: Request
    ) -> bool:
        """Do the same for a request; without an answer the asker treats it as not delivered."""
        message = self._understood(request.data, kind, "not answered")
        return message is not None and self._inbox.put(message, partial(handle, message, request))

    def _understood(self, data: bytes, kind: type[Message], otherwise: str) -> Message | None:
        try:
            return decode(data, kind)
        except InvalidMessage as error:
            _log.warning("%s: %s", otherwise, error)
            self._other_version(error)
            return None

    def _other_version(self, error: InvalidMessage) -> None:
        """Tell, once in a while, that somebody's messages are of another version; from any thread."""
        if error.field == "schema":
            self._inbox.note(partial(self.supervisor.contact.other_version, str(error)))

    def _answer(self, handle: Callable[..., Message], message: Message, request: Request) -> None:
        request.answer(encode(handle(message)))

    def _on_lease(self, message: LeaseRequest, request: Request) -> None:
        request.answer(encode(self.supervisor.on_lease(message, site_of(request.data))))

    def _on_model(self, transfer: ModelTransfer, request: Request) -> None:
        taken = self.supervisor.reception.take(transfer)
        if isinstance(taken, ModelTrial):
            self._try_model(taken, partial(self._take_outcome, taken, request))
        else:
            request.answer(encode(taken))

    def _take_outcome(self, trial: ModelTrial, request: Request, outcome: Outcome) -> None:
        """Take the outcome of a model's trial; from any thread."""
        settle = partial(self.supervisor.reception.finish_trial, trial, outcome)
        self._inbox.put_own(lambda: request.answer(encode(settle())))

    def _on_move_target(self, message: MoveTarget) -> None:
        """Move the simulated target for the holder of the lease, within its bounds."""
        contact = self.supervisor.contact
        if not contact.lease.lease_id or message.lease_id != contact.lease.lease_id:
            return
        if contact.is_fresh(message.echo) and len(message.position_m) == self._n_dims:
            self.embodiment.world.move_target(np.array(message.position_m))

    def _on_report(self, _request: ReportRequest) -> ExecutionReport:
        now, last = self.supervisor.stamp(), self.supervisor.last_execution
        return last.report(now, self.overruns) if last else ExecutionReport(stamp=now)

    def _on_catalogue(self, _request: CatalogueRequest) -> CatalogueReply:
        return self.supervisor.recordings.catalogue.list(self.supervisor.stamp())

    def _on_blob(self, request: BlobRequest) -> BlobReply:
        return self.supervisor.recordings.catalogue.part(request, self.supervisor.stamp())
