"""Time until fresh data after an outage or a restart, with real processes.

Fresh is a report that is at most 0.1 s older than reports usually are when they come. Counted from the moment
at which the relay forwards again, the restarted robot says that it is ready, or the restarted operator's site
has opened its transport.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from farhand.common.impairment.link_control import RelayControl
from farhand.evaluation.harness.real_sites import RealSites
from farhand.evaluation.link.link_delay import scheduling

Case = dict[str, Any]

DELAYS_S = (0.0, 0.3, 1.0)
_REPEATS = 5
_OUTAGE_S = 3.0
FRESH_S = 0.1
_STALL_SLACK_S = 0.25
_RESTART_S, _WAYS = 1.5, 6


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one case per run: concurrent cases would disturb each other."""
    del seed  # nothing here is random
    return [{"repeats": trials or _REPEATS}]


def trial(case: Case) -> Case:
    """Run all outages and restarts at all delays."""
    results = []
    for delay_s in DELAYS_S:
        with RealSites(delay_s) as sites:
            sites.wait_for("control of the robot", lambda p: p.in_control)
            for name, recover in RECOVERIES.items():
                took_s = [_settled(sites, recover) for _ in range(case["repeats"])]
                results.append({"delay_s": delay_s, "what": name, "took_s": took_s})
    return {"recoveries": results, "scheduling": scheduling(), "load": os.getloadavg()[0]}


def _settled(sites: RealSites, recover: Callable[[RealSites], float]) -> float:
    """Return the time of one recovery [s], once the one before is over: the site has the control of the robot."""
    sites.wait_for("control of the robot", lambda p: p.in_control)
    return recover(sites)


def _after_stall(sites: RealSites) -> float:
    return _after_outage(sites, lambda control: control.outage("stall", _OUTAGE_S))


def _after_reset(sites: RealSites) -> float:
    return _after_outage(sites, lambda control: control.outage("reset", _OUTAGE_S))


def _after_outage(sites: RealSites, begin: Callable[[RelayControl], object]) -> float:
    """Return the time from the relay forwarding again to the first fresh report [s]."""
    apart_s = usual_apart_s(sites)
    begin(sites.control)
    over_s = time.monotonic() + _OUTAGE_S
    heard = sites.wait_until_heard(
        "fresh data",
        lambda heard: heard.arrived_s > over_s and heard.arrived_s - heard.sent_s <= apart_s + FRESH_S,
    )
    return heard.arrived_s - over_s


def _after_robots_restart(sites: RealSites) -> float:
    before = {heard.boot for heard in sites.heard}
    ready_s = sites.restart_robot()
    return sites.wait_until_heard("the new boot", lambda heard: heard.boot not in before).arrived_s - ready_s


def _after_consoles_restart(sites: RealSites) -> float:
    sites.close_console()
    opened_s = sites.open_console()
    took_s = sites.wait_until_heard("a report", lambda heard: heard.arrived_s > opened_s).arrived_s - opened_s
    sites.wait_for("control of the robot", lambda p: p.in_control)
    return took_s


RECOVERIES = {
    "stall": _after_stall,
    "reset": _after_reset,
    "restart of the robot's site": _after_robots_restart,
    "restart of the operator's site": _after_consoles_restart,
}


def usual_apart_s(sites: RealSites) -> float:
    """Return the usual difference of arrival and stamp: the delay plus the clocks' offset [s]."""
    began_s = time.monotonic()
    sites.wait_until_heard("a second of reports", lambda heard: heard.arrived_s > began_s + 1.0)
    recent = [each.arrived_s - each.sent_s for each in sites.heard if each.arrived_s > began_s]
    return float(np.median(recent))


def limit_s(what: str, delay_s: float) -> float:
    """Return the bound on the recovery time [s]."""
    return delay_s + _STALL_SLACK_S if what == "stall" else _RESTART_S + _WAYS * delay_s


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Tabulate median and worst beside the limit."""
    rows = [
        {
            "what": each["what"],
            "delay_s": each["delay_s"],
            "p50_s": float(np.median(each["took_s"])),
            "worst_s": max(each["took_s"]),
            "limit_s": limit_s(each["what"], each["delay_s"]),
            "n": len(each["took_s"]),
        }
        for each in results[0]["recoveries"]
    ]
    passed = all(row["worst_s"] <= row["limit_s"] for row in rows)
    lines = [
        "# Fresh data after an outage or a restart",
        "",
        f"Outages of {_OUTAGE_S:g} s. {'Every one is' if passed else 'NOT every one is'} within its limit.",
        "",
        "| after | one way s | p50 s | worst s | limit s | n |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {r['what']} | {r['delay_s']:g} | {r['p50_s']:.3f} | {r['worst_s']:.3f} | {r['limit_s']:.2f} | {r['n']} |"
        for r in rows
    ]
    lines += [
        "",
        f"Scheduled with {results[0]['scheduling']}; load of the machine {results[0]['load']:.1f}, on {os.cpu_count()} cores.",
    ]
    return {"passed": passed, "recoveries": rows}, "\n".join(lines)
