"""Study of the modes: the exhaustive check of one operator and of two, and its mutants."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from farhand.common.mode_table import TABLE, Action, Cause, ControlMode, Guard, Phase
from farhand.common.wire.messages import CommandReply
from farhand.evaluation.modes.mode_space import Exploration, explore
from farhand.remote_site.motion.motion import Motion
from farhand.remote_site.motion.plans import Plans
from farhand.remote_site.supervision.admission import CommandLog
from farhand.remote_site.supervision.freshness import Freshness, Verdict
from farhand.remote_site.supervision.guards import ForceGuard, SightGuard
from farhand.remote_site.supervision.operator_session import OperatorSession
from farhand.remote_site.supervision.recordings import Recordings

Case = dict[str, Any]

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
    "the force guard feels nothing": lambda: _method(ForceGuard, "reason", lambda *_: None),
    "the loss of sight changes nothing": lambda: _method(SightGuard, "reason", lambda *_: None),
    "any age is fresh": lambda: _method(Freshness, "judge", lambda *_, **__: Verdict(None, 0.1)),
    "the watchdog sleeps": lambda: _method(OperatorSession, "lost_reason", lambda *_: None),
    "commands run as often as they arrive": lambda: _method(CommandLog, "reply_to", _never_heard_of),
    "any plan will do": lambda: _method(Plans, "refusal", lambda *_: None),
    "a recording outlives DIRECT": lambda: _method(Recordings, "leave", lambda *_: None),
    "nothing ends when it is left": lambda: _method(Motion, "end", lambda _self: None),
}
"""Mutants by their defect."""


def _never_heard_of(_self: CommandLog, _command_id: str) -> CommandReply | None:
    return None


_DEPTH_OF_TWO = 8
_SHORT_DEPTH = 3
_SHORT_MUTANTS = ("couple is allowed in DISARMED", "stop leads to DISARMED", "any age is fresh")


def cases(trials: int | None, seed: int) -> list[Case]:
    """List the two searches and one search per mutant; shortened when a number of trials is given."""
    del seed  # nothing here is random
    if trials is not None:
        short = {"max_depth": _SHORT_DEPTH}
        searches = [{"mutant": "", "operators": n, **short} for n in (1, 2)]
        return searches + [{"mutant": name, "operators": 1, "max_depth": None} for name in _SHORT_MUTANTS]
    return [
        {"mutant": "", "operators": 2, "max_depth": _DEPTH_OF_TWO},
        {"mutant": "", "operators": 1, "max_depth": None},
        *({"mutant": name, "operators": 1, "max_depth": None} for name in MUTANTS),
    ]


def trial(case: Case) -> Case:
    """Run one search."""
    began_s = time.monotonic()
    if case["mutant"]:
        with MUTANTS[case["mutant"]]():
            found = explore(case["operators"], case["max_depth"])
    else:
        found = explore(case["operators"], case["max_depth"])
    return {**case, **_plain(found), "took_s": time.monotonic() - began_s}


def summarise(results: list[Case]) -> tuple[Case, str]:
    """State whether the shipped modes keep every rule and every mutant breaks one."""
    shipped = [result for result in results if not result["mutant"]]
    mutants = [result for result in results if result["mutant"]]
    caught = [result for result in mutants if result["broken"]]
    summary = {
        "broken": [result["broken"] for result in shipped if result["broken"]],
        "n_mutants": len(mutants),
        "n_caught": len(caught),
    }
    lines = [
        "# The modes, exhaustively",
        "",
        "| operators | states | transitions | depth | closed | broken rule |",
    ]
    lines += ["|---|---|---|---|---|---|"]
    for r in shipped:
        closed = "yes" if r["closed"] else f"to depth {r['max_depth']}"
        row = (
            r["operators"],
            f"{r['n_states']:,}",
            f"{r['n_transitions']:,}",
            r["depth"],
            closed,
            r["broken"] or "none",
        )
        lines.append("| " + " | ".join(map(str, row)) + " |")
    lines += [
        "",
        f"{len(caught)} of {len(mutants)} mutants are caught.",
        "",
        "| mutant | rule and events that catch it |",
        "|---|---|",
    ]
    lines += [f"| {r['mutant']} | {r['broken'] or '**not caught**'} |" for r in mutants]
    return summary, "\n".join(lines)


def _plain(found: Exploration) -> Case:
    return {
        "n_states": found.n_states,
        "n_transitions": found.n_transitions,
        "depth": found.depth,
        "closed": found.closed,
        "modes": sorted(found.modes),
        "broken": found.broken,
    }
