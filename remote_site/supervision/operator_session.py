"""Judgement of the operator's messages: its lease, their age, and the silence between them."""

from __future__ import annotations

import math

from farhand.common.clock import BootClock
from farhand.common.link.budget import period_s
from farhand.common.task import TaskSet
from farhand.common.wire import keys
from farhand.common.wire.messages import (
    FRAME_BYTES,
    MAX_TELEMETRY_BYTES,
    Command,
    Heartbeat,
    LeaseReply,
    LeaseRequest,
    Stamp,
)
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.supervision.freshness import Freshness
from farhand.remote_site.supervision.lease import Lease

_INPUT_TTL_MAX_S = 1.0
_SLOWED_S = 0.25
"""Longest time between two reports that a lossy link slows down for which messages are given more time [s]."""
_OTHER_VERSION_S = 10.0
"""Time for which a site of another version counts as there: it renews its lease each second [s]."""
_SILENCE_S = 0.5
"""Watchdog of DIRECT: longest silence beyond the link's usual delay [s]."""


class OperatorSession:
    """Judge of the operator's messages, and watchdog of silence.

    Args:
        config: Limits.
        clock: The robot's time.
        n_frames: Number of task frames, which reports have.
    """

    def __init__(self, config: RemoteConfig, clock: BootClock, n_frames: int = 1):
        self._clock, self._max_age_s = clock, config.max_age_s
        self.lease = Lease(config.lease_s)
        most_bytes = MAX_TELEMETRY_BYTES + (n_frames - 1) * FRAME_BYTES
        telemetry_s = period_s(keys.TELEMETRY, config.telemetry_hz, most_bytes, config.link.rate_bps)
        self._telemetry_s = telemetry_s
        self._freshness = Freshness(clock, config.max_age_s, telemetry_s)
        self._usual_for = ""
        self._newest_echo_ns = 0
        self._heartbeat_session = ""
        self.heartbeat_seq = 0
        self.heartbeat_received_ns = 0
        self.stale_refused = 0
        self.misnamed = 0
        """Number of requests under another name than that in the sender's certificate, all of them refused."""
        self._other_version, self._other_version_s = "", -math.inf
        self.delay_changed = False
        """True once the usual delay has changed: the coupled operator is decoupled for it, then this is cleared."""

    def reports_every(self, gap_s: float) -> None:
        """Take note of the time between two reports as the link lets them out at present [s], see `link/pace.py`."""
        self._freshness.telemetry_period_s = max(self._telemetry_s, min(gap_s, _SLOWED_S))

    @property
    def _silence_s(self) -> float:
        """Longest silence [s]: on a link so narrow that reports are rare, even the newest report is old."""
        return max(_SILENCE_S, self._freshness.two_reports_s)

    def other_version(self, words: str) -> None:
        """Process a message that was dropped because its version differs."""
        self._other_version, self._other_version_s = words, self._clock.now_s()

    @property
    def not_understood(self) -> str:
        """Reason why a site that was heard a moment ago is not understood; empty for none."""
        recent = self._clock.now_s() - self._other_version_s < _OTHER_VERSION_S
        return self._other_version if recent else ""

    def answer(
        self, request: LeaseRequest, tasks: TaskSet, now: Stamp, certified: str = ""
    ) -> LeaseReply:  # fmt: skip
        """Grant, renew or refuse the lease, and say what the robot is.

        Args:
            request: The request.
            tasks: Tasks of the robot.
            now: Present time.
            certified: Name in the certificate of the asking site; empty where none tells it.
        """
        if certified not in ("", request.site_name):
            self.misnamed += 1
            reason, age_s = because(Code.OTHER_NAME, site=certified, text=request.site_name), None
        else:
            reason, age_s = self._refusal(request)
        holds = reason is None
        theirs = self.lease.session == request.session
        return LeaseReply(
            granted=holds,
            lease_id=self.lease.lease_id if theirs else "",  # one late renewal does not end it
            holder=self.lease.holder,
            reason=reason,
            asked_by=self.lease.asked_by if holds else "",
            stamp=now,
            tasks=tasks.names,
            n_dims=tasks.first.space.n_dims,
            newest_age_s=age_s,
        )

    def _refusal(self, request: LeaseRequest) -> tuple[Reason | None, float | None]:
        """Take or renew the lease: why not (None when granted), and the age of the request's echo [s]."""
        now_s = self._clock.now_s()
        self.lease.expire(now_s)
        is_renewal = self.lease.is_held_by(request.session, self.lease.lease_id)
        # What is usual is learned from the holder alone: another site may be nearer or further away.
        verdict = (self._freshness.renew if is_renewal else self._freshness.judge)(request.echo)
        self.delay_changed = self.delay_changed or verdict.delay_changed
        late = verdict.reason is not None
        if is_renewal and late and not verdict.delay_changed and not self._awaits_report(request):
            self.stale_refused += 1
            return verdict.reason, verdict.age_s
        heard_s = now_s - verdict.age_s if verdict.age_s is not None and verdict.age_s >= 0.0 else None
        late_s = max(0.0, (verdict.age_s or 0.0) - self.usual_age_s) if is_renewal else 0.0
        reason = self.lease.request(
            request.session, request.site_name, now_s, request.wish, not late, heard_s, late_s
        )
        if self.lease.session and self.lease.session != self._usual_for:
            self._usual_for = self.lease.session
            self._freshness.forget()
        if reason is None:
            if not is_renewal:
                self._freshness.renew(request.echo)
            self._heard(request.echo)
        return reason, verdict.age_s

    def _awaits_report(self, request: LeaseRequest) -> bool:
        """Decide whether the holder may still wait for its first report, without which it cannot echo."""
        unheard = request.echo is None and self._freshness.reference_s is None
        return unheard and self._clock.now_s() - self.lease.since_s <= self._max_age_s

    def command_refusal(self, command: Command) -> Reason | None:
        """Return the reason against a command in its lease or its age; None if both are right."""
        if not self.lease.is_held_by(command.session, command.lease_id):
            return self._not_held_by(command.session)
        verdict = self._freshness.judge(command.echo)
        if verdict.reason is not None:
            self.stale_refused += 1
            return verdict.reason
        self._heard(command.echo)
        return None

    def _not_held_by(self, session: str) -> Reason:
        holder = self.lease.holder
        if not holder:
            return because(Code.LEASE_ENDED)
        if self.lease.session == session:
            return because(Code.LEASE_CHANGED)
        code = Code.TAKEN_OVER if self.lease.was_replaced(session) else Code.OTHER_IN_CONTROL
        return because(code, site=holder)

    def is_fresh(self, echo: Stamp) -> bool:
        """Decide by its echo whether an input of the operator's hand is fresh enough to move the robot."""
        if self._freshness.judge(echo, _INPUT_TTL_MAX_S, "input").reason is not None:
            self.stale_refused += 1
            return False
        self._heard(echo)
        return True

    def heartbeat(self, heartbeat: Heartbeat) -> None:
        """Process a heartbeat; only the lease holder's count."""
        if not self.lease.is_held_by(heartbeat.session, self.lease.lease_id):
            return
        if heartbeat.seq > self.heartbeat_seq or heartbeat.session != self._heartbeat_session:
            self._heartbeat_session, self.heartbeat_seq = heartbeat.session, heartbeat.seq
            self.heartbeat_received_ns = self._clock.now_ns()
        self._heard(heartbeat.echo)

    @property
    def usual_age_s(self) -> float:
        """Usual age of an arriving message [s]; zero while unknown."""
        return self._freshness.reference_s or 0.0

    @property
    def heard_s(self) -> float | None:
        """Age of the newest message heard from the operator [s]; None before the first."""
        return self._clock.now_s() - self._newest_echo_ns * 1e-9 if self._newest_echo_ns else None

    def silent_s(self, now_s: float) -> float:
        """Return the excess of the newest message's age over the usual age [s]."""
        return now_s - self._newest_echo_ns * 1e-9 - self.usual_age_s

    def lost_reason(self, lease_id: str, now_s: float) -> Reason | None:
        """Return the reason why this lease no longer drives the robot; None while it does."""
        if lease_id != self.lease.lease_id:
            return because(Code.DELAY_CHANGED if self._freshness.rising else Code.LEASE_LOST)
        if self.delay_changed:
            return because(Code.DELAY_CHANGED)
        if self.silent_s(now_s) > self._silence_s:
            return because(Code.SILENCE, limit_s=self._silence_s)
        return None

    def _heard(self, echo: Stamp | None) -> None:
        # Ignore stamps that this robot never issued: a forged one would keep the watchdog fed.
        if echo is not None and echo.boot == self._clock.boot and echo.t_ns <= self._clock.now_ns():
            self._newest_echo_ns = max(self._newest_echo_ns, echo.t_ns)
