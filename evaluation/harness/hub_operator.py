"""Operator's end of a robot's link, which keeps its lease as a site does; one process may have many."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence

from farhand.common.errors import ProcessFailed
from farhand.common.link.link import ZenohLink
from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import (
    Command,
    CommandReply,
    Heartbeat,
    LeaseReply,
    LeaseRequest,
    Telemetry,
)

PATIENCE_S = 120.0
TASK = "planar"
_HEARTBEAT_S, _RENEWALS = 0.1, 10


class HubOperator:
    """Operator's end of one robot: it renews its lease and sends heartbeats as a site does, and times its commands.

    Args:
        link: To the robot.
        site: Name of the site.
        robot: Name of the robot.
    """

    def __init__(self, link: ZenohLink, site: str, robot: str):
        self.site, self.robot, self._link = site, robot, link
        self._session, self._lease_id, self._number = f"{site} of {robot}", "", 0
        self._changed = threading.Condition()
        self._newest: Telemetry | None = None
        self._arrived_s = float("-inf")
        self._closed = threading.Event()
        link.subscribe(keys.TELEMETRY, self._take)
        self._thread = threading.Thread(target=self._keep, daemon=True)
        self._thread.start()

    @property
    def newest(self) -> Telemetry | None:
        """Newest report; None before the first."""
        return self._newest

    @property
    def arrived_s(self) -> float:
        """Arrival of the newest report [s]."""
        return self._arrived_s

    @property
    def holds(self) -> bool:
        """True while the robot says that this site has the control."""
        return self._newest is not None and bool(self._lease_id) and self._newest.lease == self._lease_id[:4]

    def until(self, what: str, holds: Callable[[Telemetry], bool]) -> Telemetry:
        """Wait for a report that fits, and return it.

        Raises:
            ProcessFailed: When none came in time.
        """
        with self._changed:
            fits = self._changed.wait_for(
                lambda: self._newest is not None and holds(self._newest), PATIENCE_S
            )
            if not fits or self._newest is None:
                raise ProcessFailed(f"{self.site} waited {PATIENCE_S:.0f} s for {what} of {self.robot}")
            return self._newest

    def command(self, action: Action, timeout_s: float = 10.0) -> tuple[float, CommandReply | None]:
        """Send a command; return the time until its answer [s], and the answer, None without one."""
        self._number += 1
        command = Command(
            command_id=f"{self._session} {self._number}", session=self._session, lease_id=self._lease_id, action=action,
            echo=self._newest.stamp if self._newest is not None else None, task=TASK,
        )  # fmt: skip
        began_s = time.monotonic()
        answer = self._link.ask_and_wait(keys.COMMAND, encode(command), timeout_s)
        took_s = time.monotonic() - began_s
        return took_s, decode(answer, CommandReply) if answer is not None else None

    def is_answer(self, reply: CommandReply | None) -> bool:
        """Decide whether a reply answers the newest command of this end."""
        return reply is not None and reply.command_id == f"{self._session} {self._number}"

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._thread.join()

    def _keep(self) -> None:
        number = 0
        while not self._closed.wait(_HEARTBEAT_S):
            echo = self._newest.stamp if self._newest is not None else None
            if self.holds:
                self._link.send(
                    keys.HEARTBEAT, encode(Heartbeat(session=self._session, seq=number, echo=echo))
                )
            if number % _RENEWALS == 0:
                request = LeaseRequest(session=self._session, site_name=self.site, echo=echo)
                self._link.ask(keys.LEASE, encode(request), 5.0, self._on_lease)
            number += 1

    def _on_lease(self, answer: bytes | None) -> None:
        if answer is not None:
            self._lease_id = decode(answer, LeaseReply).lease_id

    def _take(self, data: bytes) -> None:
        report = decode(data, Telemetry)
        with self._changed:
            self._newest, self._arrived_s = report, time.monotonic()
            self._changed.notify_all()


def drive(ends: Sequence[HubOperator], robot: str) -> HubOperator:
    """Couple a robot to the operator in control of it, and return that operator's end.

    Raises:
        ProcessFailed: When the robot does not follow.
    """
    give_up_s = time.monotonic() + PATIENCE_S
    path = {ControlMode.DISARMED: Action.ARM, ControlMode.HOLD: Action.COUPLE}
    while time.monotonic() < give_up_s:
        for end in ends:
            if end.holds and end.robot == robot and end.newest is not None:
                if end.newest.mode is ControlMode.DIRECT:
                    return end
                if (action := path.get(end.newest.mode)) is not None:
                    end.command(action)
        time.sleep(0.1)
    raise ProcessFailed("no operator could couple the robot")


def return_s(ends: Sequence[HubOperator], ready_s: float) -> float:
    """Return the time after the hub's start until every site has a new report and an answer [s]."""
    waiting, give_up_s, last_s = list(ends), ready_s + PATIENCE_S, ready_s
    while waiting and time.monotonic() < give_up_s:
        for end in list(waiting):
            if end.arrived_s > ready_s and end.is_answer(end.command(Action.DISARM, 1.0)[1]):
                waiting.remove(end)
                last_s = time.monotonic()
        time.sleep(0.01)
    return last_s - ready_s if not waiting else float("inf")
