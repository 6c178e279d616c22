"""Commands to the robot: the lease, the pending commands, and their outcomes."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from functools import partial

from farhand.common.link.interface import Link
from farhand.common.mode_table import Action
from farhand.common.wire import keys
from farhand.common.wire.codec import encode
from farhand.common.wire.messages import (
    Command,
    CommandReply,
    Event,
    Heartbeat,
    LeaseReply,
    LeaseRequest,
    Telemetry,
    Wish,
)
from farhand.common.wire.reason_words import sentence
from farhand.common.wire.reasons import Code, Reason, because
from farhand.local_site.console.console_state import Pending
from farhand.local_site.exchange.notices import Notice
from farhand.local_site.exchange.report_age import LinkMonitor
from farhand.local_site.exchange.requests import Requests

_HEARTBEAT_S = 0.1
_RENEW_S = 1.0
_WATCHING_S, _NOBODY_S = 12.0, 0.25
"""Time between two heartbeats of a site without control: while another one has it, and while nobody has [s]. Only the
holder's are watched and echoed; the others keep reports coming on a lossy link. A mere watcher also renews that rarely,
so that a narrow link carries hardly more for many watchers than for one."""
_GIVE_UP_S = 15.0
_UNSETTLED_S = 30.0

Notify = Callable[[Notice], None]


class Commanding:
    """Keeper of the lease and sender of commands, followed to their end. Used by the console's thread alone.

    Args:
        link: To the robot.
        inquiries: Asks the robot.
        monitor: Measures the round trip from the heartbeats.
        site_name: Name of this site.
        notify: Shows a message to the operator.
        wish: First wish of this site about the control of the robot.
        on_model_lost: Called when the robot lacks a model that it had confirmed.
    """

    def __init__(
        self,
        link: Link,
        inquiries: Requests,
        monitor: LinkMonitor,
        site_name: str,
        notify: Notify,
        wish: Wish = Wish.CONTROL,
        on_model_lost: Callable[[], None] = lambda: None,
    ):
        self._link, self._inquiries, self._monitor = link, inquiries, monitor
        self._site_name, self._notify, self._on_model_lost = site_name, notify, on_model_lost
        self.session = secrets.token_hex(8)
        self.present_wish = wish
        self.asked_by = ""
        """Name of the site that asks this one for the control, empty for none."""
        self.robot_tasks: tuple[str, ...] = ()
        """Names of the robot's tasks; none before it has answered."""
        self.lease_id = ""
        self.why_not_in_control: Reason | None = because(Code.NOT_ANSWERED)
        self.pending: dict[Action, Pending] = {}
        self.round_trips_s: list[float] = []
        self._lease_stamp_ns, self._lease_boot = 0, ""
        # Not from zero: the robot echoes its holder's heartbeats, and those of two sites must differ.
        self._heartbeat_seq = secrets.randbelow(2**31)
        self._heartbeat_s = self._renewed_s = float("-inf")
        self._renewed_boot = ""

    def in_control(self, robot: Telemetry | None) -> bool:
        """Return whether the robot itself reports that this site holds the lease."""
        return robot is not None and bool(self.lease_id) and robot.lease == self.lease_id[:4]

    def wish(self, wish: Wish) -> None:
        """Set another wish about the control of the robot, and send it at once with a renewal."""
        self.present_wish = wish
        self._renewed_s = float("-inf")

    def tick(self, robot: Telemetry | None, now_s: float) -> None:
        """Send a heartbeat, renew the lease, and give up commands that were never answered."""
        echo = robot.stamp if robot else None
        if now_s - self._heartbeat_s >= self._heartbeat_period_s(robot):
            self._heartbeat_s = now_s
            self._heartbeat_seq += 1
            self._monitor.heartbeat_sent(self._heartbeat_seq, now_s)
            heartbeat = Heartbeat(session=self.session, seq=self._heartbeat_seq, echo=echo)
            self._link.send(keys.HEARTBEAT, encode(heartbeat))
        boot = robot.stamp.boot if robot else ""
        if now_s - self._renewed_s >= self._renewal_period_s or boot != self._renewed_boot:
            # Answer the first report of a boot at once: its echo gives a restarted site its own lease back.
            self._renewed_s, self._renewed_boot = now_s, boot
            wish = self.present_wish
            request = LeaseRequest(session=self.session, site_name=self._site_name, wish=wish, echo=echo)
            self._inquiries.ask(keys.LEASE, request, LeaseReply, 0.0, self._on_lease)
        for action, pending in list(self.pending.items()):
            if now_s - pending.since_s > _UNSETTLED_S:
                del self.pending[action]
                self._tell(now_s, action, because(Code.NEVER_ENDED))

    def _heartbeat_period_s(self, robot: Telemetry | None) -> float:
        if robot is None or self.in_control(robot):
            return _HEARTBEAT_S
        return _WATCHING_S if robot.holder else _NOBODY_S

    @property
    def _renewal_period_s(self) -> float:
        only_watches = self.why_not_in_control is not None and self.why_not_in_control.code == Code.WATCHING
        return _WATCHING_S if only_watches and self.present_wish is Wish.WATCH else _RENEW_S

    def command(
        self,
        action: Action,
        robot: Telemetry,
        now_s: float,
        task: str = "",
        sha256: str = "",
        plan_id: int = 0,
        pace: float = 1.0,
    ) -> None:
        """Send a command; it is pending until the robot reports its end."""
        command = Command(
            command_id=secrets.token_hex(8),
            session=self.session,
            lease_id=self.lease_id,
            action=action,
            echo=robot.stamp,
            task=task,
            model_sha256=sha256,
            plan_id=plan_id,
            pace=pace,
        )
        self.pending[action] = Pending(command.command_id, now_s)
        answered = partial(self._on_reply, action, command.command_id, now_s)
        wanted = partial(self._is_pending, action, command.command_id)
        self._inquiries.ask(keys.COMMAND, command, CommandReply, _GIVE_UP_S, answered, wanted)

    def _is_pending(self, action: Action, command_id: str) -> bool:
        pending = self.pending.get(action)
        return pending is not None and pending.command_id == command_id

    def refused(self, why: Reason) -> None:
        """Take the robot's reason for not serving this site, and notify the operator once."""
        before, self.why_not_in_control = self.why_not_in_control, why
        if before is None or before.code != why.code:
            self._tell(self._inquiries.now_s(), "control", why)

    def on_event(self, event: Event, now_s: float) -> None:
        """Process an event; a command's second answer settles it."""
        for action, pending in list(self.pending.items()):
            if event.command_id and pending.command_id == event.command_id:
                del self.pending[action]
        what = event.action or event.kind
        robot_s = event.stamp.t_ns * 1e-9
        late_s = self._monitor.late_s(event.stamp, now_s)
        text = sentence(event.reason, event.cause)
        self._notify(
            Notice(
                now_s,
                what,
                text,
                event.succeeded,
                event.measured,
                event.who,
                robot_s,
                late_s,
                event.reason.code,
            )
        )

    def on_report(self, robot: Telemetry) -> None:
        """Process a newer report, which may settle an accepted command."""
        for action, pending in list(self.pending.items()):
            if pending.accepted_ns is not None and action is not Action.PREVIEW:
                later = robot.stamp.t_ns > pending.accepted_ns and robot.mode is pending.leads_to
                if later:
                    del self.pending[action]

    def _on_lease(self, reply: LeaseReply | None, _took_s: float) -> None:
        if reply is None:
            return  # the age of the data shows the operator that the link is down
        if reply.stamp.boot == self._lease_boot and reply.stamp.t_ns < self._lease_stamp_ns:
            return
        self._lease_boot, self._lease_stamp_ns = reply.stamp.boot, reply.stamp.t_ns
        self.lease_id, self.robot_tasks = reply.lease_id, reply.tasks
        self.why_not_in_control = None if reply.granted else reply.reason
        if reply.asked_by and reply.asked_by != self.asked_by:
            self._notify(
                Notice(
                    self._inquiries.now_s(),
                    "control",
                    f"{reply.asked_by} asks for the control",
                    who=reply.asked_by,
                )
            )
        self.asked_by = reply.asked_by
        if (self.present_wish is Wish.ASK and reply.granted) or (
            self.present_wish is Wish.GIVE and not reply.granted
        ):
            # The control changed hands as wished; after a hand-over this site asks no more.
            self.present_wish = Wish.CONTROL if reply.granted else Wish.WATCH

    def _on_reply(
        self, action: Action, command_id: str, asked_s: float, reply: CommandReply | None, took_s: float
    ) -> None:
        if reply is not None and reply.accepted:
            self.round_trips_s.append(took_s)
        pending = self.pending.get(action)
        if pending is None or pending.command_id != command_id:
            return  # the report of its end came before the answer
        if reply is None:
            del self.pending[action]
            self._tell(asked_s, action, because(Code.NOT_DELIVERED))
        elif not reply.accepted:
            del self.pending[action]
            why = reply.reason or because(Code.OTHER, text="")
            self._tell(asked_s + took_s, action, why, "refused: ")
            if why.code == Code.NO_SUCH_MODEL:
                self._on_model_lost()
        else:
            self.pending[action] = Pending(command_id, pending.since_s, reply.stamp.t_ns, reply.mode)

    def _tell(self, at_s: float, action: str, why: Reason, prefix: str = "") -> None:
        """Tell the operator why an action was not done."""
        text = f"{prefix}{sentence(why)}"
        self._notify(Notice(at_s, action, text, good=False, measured=why.measured, code=why.code))
