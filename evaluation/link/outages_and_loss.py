"""Fresh data after outages in which all datagrams are lost, and whole jobs over links that lose, double and reorder them."""

from __future__ import annotations

import json
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from farhand.common.errors import FarhandError
from farhand.evaluation.harness.real_sites import PATIENCE_S, RealSites
from farhand.evaluation.link.link_recovery import FRESH_S, usual_apart_s

Case = dict[str, Any]

WAY_S = 0.3
OUTAGES_S = (2.0, 10.0, 15.0, 28.0, 60.0)
OVERTAKING_MS = 100.0
"""Time that an overtaking datagram gains [ms]: two reports. netem's skip the whole delay, which no real path can."""
SURVIVED_S = 28.0
"""Longest outage that the connection survives [s]."""
LOSSES: dict[str, Case] = {
    "5 % lost": {"loss": 5.0},
    "10 % lost": {"loss": 10.0},
    "20 % lost": {"loss": 20.0},
    "5 % lost, doubled and reordered": {
        "loss": 5.0,
        "duplicate": 10.0,
        "reorder": 10.0,
        "reorder_ms": OVERTAKING_MS,
    },
    "5 % lost, doubled, reordered by the whole delay": {"loss": 5.0, "duplicate": 10.0, "reorder": 10.0},
    "other ports in the middle": {"rebind": True},
}
"""Impairments of each direction, by name; `rebind`: the link continues from other ports while the robot executes."""
_INTO_MOTION_S, _SETTLED_S = 2.0, 8.0


def fresh_limit_s(outage_s: float) -> float:
    """Return the largest time from the end of an outage to fresh data [s]; after long ones a new connection is opened."""
    return WAY_S + 0.25 if outage_s <= SURVIVED_S else 1.5 + 8.0 * WAY_S


def fresh_after_s(outage_s: float, n: int) -> list[float]:
    """Lose everything for a time, again and again; return the time from each end to the first fresh report [s]."""
    took_s = []
    with RealSites(WAY_S, transport="quic") as sites:
        for _ in range(n):
            sites.wait_for("control of the robot", lambda p: p.in_control)
            time.sleep(_SETTLED_S)
            apart_s = usual_apart_s(sites)
            sites.control.outage("blackhole", outage_s)
            over_s = time.monotonic() + outage_s
            heard = sites.wait_until_heard(
                "fresh data",
                lambda heard, over_s=over_s, apart_s=apart_s: (
                    heard.arrived_s > over_s and heard.arrived_s - heard.sent_s <= apart_s + FRESH_S
                ),
            )
            took_s.append(heard.arrived_s - over_s)
    return took_s


def job(loss: str, seed: int, task: str = "hot-stab") -> Case:
    """Have the scripted operator do the whole job over an impaired link.

    Args:
        loss: One of `LOSSES`.
        seed: Seed of everything.
        task: Name of the task.
    """
    way = {**LOSSES[loss], "seed": seed}
    rebinds = way.pop("rebind", False)
    try:
        with (
            RealSites(WAY_S, with_console=False, task=task, seed=seed, transport="quic") as sites,
            ThreadPoolExecutor(1) as pool,
        ):
            sites.control.set(uplink=way, downlink=way)
            done = pool.submit(sites.run_demo)
            if rebinds and _executes(sites.robot_events, done.done):
                time.sleep(_INTO_MOTION_S)
                sites.control.rebind()
            success, status = done.result()["success"], sites.control.status()
    except FarhandError as error:
        return {"seed": seed, "success": False, "why": str(error)}
    if rebinds and status["rebinds"] != 1:
        return {"seed": seed, "success": False, "why": "the ports were not changed during the execution"}
    return {"seed": seed, "success": success, "why": "" if success else "the error was too large"}


def _executes(events: Path, is_over: Any) -> bool:
    """Wait until a robot's event log tells of an execution; return False if the job is over before."""
    until_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < until_s and not is_over():
        lines = events.read_text("utf-8").splitlines(keepends=True) if events.is_file() else []
        if any(json.loads(line)["kind"] == "executing" for line in lines if line.endswith("\n")):
            return True
        time.sleep(0.1)
    return False
