"""Mutants of the shipped modes: each breaks one row of the table, one guard or one check.

A mutant is a context in which the shipped code runs with the defect; the exhaustive check must catch it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from farhand.common.control_mode import TABLE, Action, Cause, ControlMode, Guard, Phase
from farhand.common.wire.messages import CommandReply
from farhand.remote_site.motion.motion import Motion
from farhand.remote_site.motion.plans import Plans
from farhand.remote_site.supervision.admission import CommandLog
from farhand.remote_site.supervision.freshness import Freshness, Verdict
from farhand.remote_site.supervision.guards import ForceGuard, SightGuard
from farhand.remote_site.supervision.recordings import Recordings
from farhand.remote_site.supervision.session import OperatorSession

_M = ControlMode


@contextmanager
def _row(cause: Cause, **changes: Any) -> Iterator[None]:
    """Change one row of the table."""
    shipped = TABLE[cause]
    TABLE[cause] = shipped._replace(**changes)
    try:
        yield
    finally:
        TABLE[cause] = shipped


@contextmanager
def _method(owner: type, name: str, body: Callable[..., Any]) -> Iterator[None]:
    """Replace one method by another."""
    shipped = getattr(owner, name)
    setattr(owner, name, body)
    try:
        yield
    finally:
        setattr(owner, name, shipped)


def _allowed(cause: Cause, *modes: ControlMode) -> frozenset[ControlMode]:
    return TABLE[cause].modes | set(modes)


def _not_allowed(cause: Cause, *modes: ControlMode) -> frozenset[ControlMode]:
    return TABLE[cause].modes - set(modes)


MUTANTS: dict[str, Callable[[], Any]] = {
    "couple is allowed in DISARMED": lambda: _row(Action.COUPLE, modes=_allowed(Action.COUPLE, _M.DISARMED)),
    "execute is allowed in STOPPED": lambda: _row(Action.EXECUTE, modes=_allowed(Action.EXECUTE, _M.STOPPED)),
    "disarm is allowed in STOPPED": lambda: _row(Action.DISARM, modes=_allowed(Action.DISARM, _M.STOPPED)),
    "clutch is allowed on the way": lambda: _row(Action.CLUTCH, modes=_allowed(Action.CLUTCH, _M.AUTONOMOUS)),
    "retract is allowed in DIRECT": lambda: _row(Action.RETRACT, modes=_allowed(Action.RETRACT, _M.DIRECT)),
    "abort is not allowed in PAUSED": lambda: _row(Action.ABORT, modes=_not_allowed(Action.ABORT, _M.PAUSED)),
    "disarm is not allowed in DIRECT": lambda: _row(
        Action.DISARM, modes=_not_allowed(Action.DISARM, _M.DIRECT)
    ),
    "reset leads to HOLD": lambda: _row(Action.RESET, leads_to=_M.HOLD),
    "arm leads to PAUSED": lambda: _row(Action.ARM, leads_to=_M.PAUSED),
    "stop leads to DISARMED": lambda: _row(Action.STOP, leads_to=_M.DISARMED),
    "pause leads to HOLD": lambda: _row(Action.PAUSE, leads_to=_M.HOLD),
    "nothing can follow the end of a motion": lambda: _row(Action.GO_TO_READY, at_end=False),
    "the end of a coupling changes nothing": lambda: _row(Guard.COUPLING_ENDED, modes=frozenset()),
    "a fault does not stop DIRECT": lambda: _row(Guard.FAULT, modes=_not_allowed(Guard.FAULT, _M.DIRECT)),
    "the force guard sleeps in DIRECT": lambda: _row(Guard.FORCE, modes=_not_allowed(Guard.FORCE, _M.DIRECT)),
    "the force guard retracts": lambda: _row(Guard.FORCE, phase=Phase.RETRACTING),
    "the force guard feels nothing": lambda: _method(ForceGuard, "reason", lambda *_: ("", None)),
    "the loss of sight changes nothing": lambda: _method(SightGuard, "reason", lambda *_: ("", None)),
    "any age is fresh": lambda: _method(Freshness, "judge", lambda *_, **__: Verdict(None, 0.1)),
    "the watchdog sleeps": lambda: _method(OperatorSession, "lost_reason", lambda *_: ""),
    "commands run as often as they arrive": lambda: _method(CommandLog, "reply_to", _never_heard_of),
    "any plan will do": lambda: _method(Plans, "refusal", lambda *_: ("", None)),
    "a recording outlives DIRECT": lambda: _method(Recordings, "leave", lambda *_: None),
    "nothing ends when it is left": lambda: _method(Motion, "end", lambda _self: None),
}
"""Mutants by their defect."""


def _never_heard_of(_self: CommandLog, _command_id: str) -> CommandReply | None:
    return None
