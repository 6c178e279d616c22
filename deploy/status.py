"""`farhand status`: the processes of this machine, what they say and what is wrong, for eyes and for programs."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence

import msgspec

from farhand.common.process_status import HubFacts, LinkFacts, OperatorFacts, ProcessStatus, RobotFacts
from farhand.deploy.diagnosis import Trouble, diagnose
from farhand.deploy.process_discovery import Entry, find_processes, forget_ended

HEALTHY, DEGRADED, NOT_THERE = 0, 3, 4
"""Exit statuses; 1 and 2 are those of every command."""
_VERDICTS = {HEALTHY: "healthy", DEGRADED: "degraded", NOT_THERE: "not there"}


def run_status(of: str, as_json: bool, forget: bool) -> int:
    """Ask, judge and print.

    Args:
        of: The kind of process that is asked, or `all`.
        as_json: Whether to print JSON.
        forget: Whether to forget first what has ended before.

    Returns:
        The exit status.
    """
    if forget:
        forget_ended()
    found = find_processes()
    troubles = [trouble for trouble in diagnose(found) if of in ("all", trouble.role)]
    asked = [entry for entry in found if of in ("all", entry.role)]
    verdict = judge(asked, troubles)
    if as_json:
        content = {
            "verdict": _VERDICTS[verdict],
            "processes": msgspec.to_builtins(asked),
            "troubles": msgspec.to_builtins(troubles),
        }
        sys.stdout.write(json.dumps(content, indent=2) + "\n")
    else:
        sys.stdout.writelines(line + "\n" for line in _lines(asked, troubles, verdict, of))
    return verdict


def judge(asked: Sequence[Entry], troubles: Sequence[Trouble]) -> int:
    """Return the exit status for the processes that were asked and their troubles."""
    if not any(entry.status is not None for entry in asked):
        return NOT_THERE
    return DEGRADED if troubles else HEALTHY


def _lines(asked: Sequence[Entry], troubles: Sequence[Trouble], verdict: int, of: str) -> Iterator[str]:
    for entry in asked:
        if (status := entry.status) is not None:
            yield f"{status.role} {status.name}: {_state(status)}"
            yield f"    {_means(status)}"
    if not asked:
        whom = "robot, link, hub or operator's site" if of == "all" else of
        yield f"no {whom} of this user runs on this machine"
    for trouble in troubles:
        yield f"! {trouble.code} ({trouble.role} {trouble.name}): {trouble.text}"
        yield f"    {trouble.remedy}"
    yield _VERDICTS[verdict]


def _state(status: ProcessStatus) -> str:
    match status.facts:
        case RobotFacts() as robot:
            heard = "nobody was heard" if robot.heard_s is None else f"heard {robot.heard_s:.1f} s ago"
            return (
                f"{robot.mode} {robot.phase}".strip()
                + f", {robot.holder or 'nobody'} in control, {heard}; {robot.control_hz:g} Hz, "
                f"{robot.overruns} overruns, {robot.waiting} waiting; model {robot.model or 'none'}"
            )
        case LinkFacts() as link:
            cut = (
                f", cut ({link.outage}) for {link.outage_left_s:.0f} s more" if link.outage != "none" else ""
            )
            return f"{link.profile} to {link.target}, {link.connections} connections, {link.queued_bytes} B queued{cut}"
        case HubFacts() as hub:
            others = ", ".join(name for name in hub.connections if name not in hub.robots)
            return f"robots: {', '.join(hub.robots) or 'none'}; others: {others or 'none'}"
        case OperatorFacts() as site:
            return _site_state(site)
    return "starting"


def _site_state(site: OperatorFacts) -> str:
    control = "in control" if site.in_control else "watching" if site.only_watches else "not in control"
    age = "unknown" if site.age_s is None else f"{site.age_s:.2f} s"
    trip = "unknown" if site.round_trip_s is None else f"{site.round_trip_s:.2f} s"
    return (
        f"robot {f'{site.robot_mode} {site.robot_phase}'.strip() or 'unknown'}, {control}; data {age} old, "
        f"link {site.link}, round trip {trip}; {site.waiting} waiting; {site.page or 'no page'}"
    )


def _means(status: ProcessStatus) -> str:
    parts = [status.endpoint, ", ".join(status.tasks), f"Farhand {status.version}", f"pid {status.pid}"]
    minutes, seconds = divmod(int(status.uptime_s), 60)
    parts.append(f"up {minutes} min {seconds} s")
    if (data := status.data) is not None:
        parts.append(f"{data.path}: {data.free_bytes / 1e9:.1f} GB free")
    return "; ".join(filter(None, parts))
