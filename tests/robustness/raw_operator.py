"""An operator's end that speaks to a real robot process message by message, well or badly."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, TypeVar

from farhand.common.link.link import EndpointSettings, ZenohLink
from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import Command, CommandReply, LeaseReply, LeaseRequest, Message, Telemetry

M = TypeVar("M", bound=Message)

PATIENCE_S = 60.0
SESSION = "the test"


class RawOperator:
    """Holds the lease of the robot at an endpoint.

    Nothing is learned here of how old messages usually are (no lease request carries an echo), so
    that a busy machine makes no message too late.
    """

    def __init__(self, endpoint: str):
        self.link = ZenohLink(EndpointSettings(connect=endpoint))
        self._changed = threading.Condition()
        self._reports: list[Telemetry] = []
        self._n_commands = 0
        self.link.subscribe(keys.TELEMETRY, self._take)
        self.report()
        request = LeaseRequest(session=SESSION, site_name="tester")
        self.lease_id = self.ask(keys.LEASE, request, LeaseReply).lease_id

    def report(self, holds: Callable[[Telemetry], bool] = lambda _: True) -> Telemetry:
        """Wait for a report, from now on, of which something holds."""
        with self._changed:
            self._reports.clear()
            found = self._changed.wait_for(lambda: any(map(holds, self._reports)), PATIENCE_S)
            assert found, self._reports[-1:]
            return next(filter(holds, self._reports))

    def ask(self, channel: Channel, message: Message, kind: type[M]) -> M:
        answer = self.ask_raw(channel, encode(message))
        assert answer is not None
        return decode(answer, kind)

    def send(self, channel: Channel, message: Message) -> None:
        self.link.send(channel, encode(message))

    def ask_raw(self, channel: Channel, data: bytes) -> bytes | None:
        """The answer to any bytes, or None without one."""
        return self.link.ask_and_wait(channel, data, PATIENCE_S)

    def new_command(self, action: Action, **fields: Any) -> Command:
        """A command that would count, but for the fields given."""
        self._n_commands += 1
        usual = {
            "command_id": f"command {self._n_commands}",
            "session": SESSION,
            "lease_id": self.lease_id,
            "echo": self.report().stamp,
            "task": "planar",
        }
        return Command(action=action, **{**usual, **fields})

    def command(self, action: Action, **fields: Any) -> CommandReply:
        return self.ask(keys.COMMAND, self.new_command(action, **fields), CommandReply)

    def bring_to_hold(self) -> Telemetry:
        """Whatever the robot does: armed and decoupled."""
        way = {ControlMode.STOPPED: Action.RESET, ControlMode.DISARMED: Action.ARM,
               ControlMode.AUTONOMOUS: Action.ABORT, ControlMode.DIRECT: Action.CLUTCH}  # fmt: skip
        while (mode := self.report().mode) is not ControlMode.HOLD:
            reply = self.command(way[mode])
            assert reply.accepted, reply.reason
            self.report(lambda told, before=mode: told.mode is not before)
        return self.report()

    def close(self) -> None:
        self.link.close()

    def _take(self, data: bytes) -> None:
        report = decode(data, Telemetry)
        with self._changed:
            self._reports.append(report)
            self._changed.notify_all()
