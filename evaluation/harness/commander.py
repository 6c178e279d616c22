"""Operator without a console: gives commands over the link in turn, and waits for both answers to each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from farhand.common.clock import VirtualTime
from farhand.common.errors import FarhandError
from farhand.common.link.interface import Link
from farhand.common.mode_table import Action
from farhand.common.model.model_file import content_hash
from farhand.common.model.model_file import encode as encode_model
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import (
    Command,
    CommandReply,
    Event,
    EventKind,
    Heartbeat,
    LeaseReply,
    LeaseRequest,
    Message,
    ModelReply,
    ModelTransfer,
    Stamp,
    Telemetry,
)
from farhand.common.wire.reason_words import sentence

_STEP_S, _PATIENCE_S = 0.01, 5.0
_HEARTBEAT_S, _RENEWAL_S = 0.1, 1.0
_SESSION = "commander"

M = TypeVar("M", bound=Message)


class NotDone(FarhandError):
    """Refusal, missing answer or failed command; the text says why."""


class Commander:
    """Operator that takes the control of the robot and keeps it while the time passes.

    Args:
        time: The time.
        end: The operator's end of the link.
    """

    def __init__(self, time: VirtualTime, end: Link):
        self._time, self._end = time, end
        self._echo: Stamp | None = None
        self._lease_id, self._count = "", 0
        self.events: list[Event] = []
        """All events of the robot, oldest first."""
        self.report: Telemetry | None = None
        """Newest report."""
        end.subscribe(keys.EVENT, lambda data: self.events.append(decode(data, Event)))
        end.subscribe(keys.TELEMETRY, self._on_report)

    def take_control(self) -> None:
        """Take the lease, renew it from now on, and arm the robot.

        Raises:
            NotDone: When the robot refuses.
        """
        self._renew()
        self._wait(lambda: bool(self._lease_id) and self.report is not None, "the lease")
        self._beat()
        self.do(Action.ARM)

    def send(self, model: TPHSMM, task: str) -> str:
        """Send a model for a task and return its hash.

        Raises:
            NotDone: When the robot does not confirm it.
        """
        content = encode_model(model)
        whole = ModelTransfer(session=_SESSION, task=task, sha256=content_hash(content), content=content)
        reply = self._ask(keys.MODEL, whole, ModelReply)
        if not (reply.accepted and reply.complete):
            raise NotDone(sentence(reply.reason))
        return reply.sha256

    def ask(self, action: Action, **fields: Any) -> Command:
        """Request an action until it is accepted, for example until the robot sees its target.

        Raises:
            NotDone: When it is still refused after some seconds.
        """
        give_up_s = self._time.now_s() + _PATIENCE_S
        while True:
            self._count += 1
            command = Command(
                command_id=f"command {self._count}", session=_SESSION, lease_id=self._lease_id, action=action,
                echo=self._echo, **fields,
            )  # fmt: skip
            reply = self._ask(keys.COMMAND, command, CommandReply)
            if reply.accepted:
                return command
            if self._time.now_s() > give_up_s:
                raise NotDone(sentence(reply.reason))
            self._run(_HEARTBEAT_S)

    def do(self, action: Action, **fields: Any) -> Event:
        """Request an action, wait until it is done, and return the event of its end.

        Raises:
            NotDone: When it is refused or fails.
        """
        command = self.ask(action, **fields)
        self._wait(lambda: self._ending(command) is not None, f"the end of {action}")
        ending = self._ending(command)
        assert ending is not None
        if not ending.succeeded:
            raise NotDone(sentence(ending.reason, ending.cause))
        return ending

    def _ending(self, command: Command) -> Event | None:
        ends = (event for event in self.events if event.command_id == command.command_id)
        return next((event for event in ends if event.kind in (EventKind.COMPLETED, EventKind.FAILED)), None)

    # The link -----------------------------------------------------------------------------------

    def _on_report(self, data: bytes) -> None:
        self.report = decode(data, Telemetry)
        self._echo = self.report.stamp

    def _beat(self) -> None:
        self._count += 1
        self._end.send(keys.HEARTBEAT, encode(Heartbeat(session=_SESSION, seq=self._count, echo=self._echo)))
        self._time.call_later(_HEARTBEAT_S, self._beat)

    def _renew(self) -> None:
        request = LeaseRequest(session=_SESSION, site_name=_SESSION, echo=self._echo)
        self._end.ask(keys.LEASE, encode(request), _PATIENCE_S, self._on_lease)
        self._time.call_later(_RENEWAL_S, self._renew)

    def _on_lease(self, data: bytes | None) -> None:
        if data is not None:
            self._lease_id = decode(data, LeaseReply).lease_id

    def _ask(self, channel: Channel, message: Message, kind: type[M]) -> M:
        answers: list[bytes | None] = []
        self._end.ask(channel, encode(message), _PATIENCE_S, answers.append)
        self._wait(lambda: bool(answers), f"an answer on {channel.key}")
        if answers[0] is None:
            raise NotDone(f"no answer on {channel.key}")
        return decode(answers[0], kind)

    def _wait(self, holds: Callable[[], bool], what: str) -> None:
        give_up_s = self._time.now_s() + 2.0 * _PATIENCE_S
        while not holds():
            if self._time.now_s() > give_up_s:
                raise NotDone(f"{what} did not come")
            self._run(_STEP_S)

    def _run(self, duration_s: float) -> None:
        self._time.run_until(self._time.now_s() + duration_s)
