"""Delay that the software adds to the link's: transport, relay and a whole command, with real processes.

For each one-way delay, without jitter: questions at 50 Hz straight from transport to transport through a
relay; then commands (Arm and Disarm in turn) of the shipped console to the shipped robot; then the whole planar job by
script. The times are compared with the injected delay. The relay's own lateness is stamped in the relay.
"""

from __future__ import annotations

import math
import os
import queue
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

from farhand.common.address import free_port
from farhand.common.clock import Rate
from farhand.common.errors import ProcessFailed
from farhand.common.impairment.link_control import RelayControl
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire import keys
from farhand.evaluation.harness.farhand_process import HOST, ReadyProcess
from farhand.evaluation.harness.real_sites import PATIENCE_S, RealSites
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.remote_site.robots.point_embodiment import CONTROL_HZ

Case = dict[str, Any]

DELAYS_S = (0.0, 0.3, 1.0, 3.0, 5.0)
TRANSPORT_LIMIT_MS = 2.0
COMMAND_LIMIT_MS = 1000.0 / CONTROL_HZ + 3.0
_QUESTIONS, _COMMANDS = 400, 40
_QUESTION_S = 0.02
_LONGEST_S = 60.0
"""Approximate duration of each delay's commands; longer delays get fewer commands [s]."""


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one case per run: concurrent cases would disturb each other."""
    del seed  # nothing here is random
    return [{"commands": trials or _COMMANDS, "questions": 10 * (trials or _QUESTIONS // 10)}]


def trial(case: Case) -> Case:
    """Measure all delays."""
    return {"delays": [_measure(delay_s, case) for delay_s in DELAYS_S], "scheduling": scheduling()}


def scheduling() -> str:
    """Describe this process's scheduling, which decides about milliseconds on a busy machine."""
    if os.sched_getscheduler(0) in (os.SCHED_FIFO, os.SCHED_RR):
        return "real-time priority"
    file = Path("/proc/self/autogroup")
    group = group_niceness(file.read_text(encoding="utf-8")) if file.exists() else 0
    return f"niceness {os.nice(0)}" + (f", {group} of its group" if group else "")


def group_niceness(line: str) -> int:
    """Parse the niceness of a session's group as Linux reports it, "/autogroup-12 nice 0"."""
    return int(line.split()[-1]) if line.strip() else 0


def _measure(delay_s: float, case: Case) -> Case:
    fits = int(_LONGEST_S / max(2 * delay_s, 1e-3))
    transport_ms = _transport_ms(delay_s, case["questions"])
    with RealSites(delay_s) as sites:
        commands_ms = _commands_ms(sites, delay_s, max(4, min(case["commands"], fits)))
        status = sites.control.status()
    return {
        "delay_s": delay_s,
        "demo": _demo(delay_s),
        "transport_ms": transport_ms,
        "commands_ms": commands_ms,
        "load": os.getloadavg()[0],
        "relay_lateness_ms": {
            way: {name: status[way][f"lateness_{name}_ms"] for name in ("p50", "p99", "max")}
            for way in ("uplink", "downlink")
        },
    }


def _demo(delay_s: float) -> Case:
    """Run the whole job over this delay."""
    try:
        with RealSites(delay_s, with_console=False) as sites:
            demo = sites.run_demo()
    except ProcessFailed as error:
        return {"success": False, "why": str(error)}
    return {"success": demo["success"], "rms_error_m": demo["execution"]["rms_error_m"]}


def _transport_ms(delay_s: float, n: int) -> list[float]:
    """Measure the time that relay and transport add to one way, for each question [ms]."""
    port = free_port()
    echo = ZenohLink(EndpointSettings(listen=f"tcp/{HOST}:{port}"))
    echo.serve(keys.REPORT, lambda request: request.answer(request.data))
    relay = ReadyProcess(
        "link", f"--listen={HOST}:0", f"--target={HOST}:{port}", f"--control={HOST}:0", "--profile=lan"
    )
    settings = {"delay_ms": 1000.0 * delay_s}
    RelayControl(HOST, relay.ready["control_port"]).set(uplink=settings, downlink=settings)
    asker = ZenohLink(EndpointSettings(connect=f"tcp/{HOST}:{relay.ready['port']}"))
    try:
        while asker.ask_and_wait(keys.REPORT, b"there?", PATIENCE_S) is None:
            pass  # not connected yet: the answer is None at once
        return [500.0 * (trip_s - 2.0 * delay_s) for trip_s in _round_trips_s(asker, n)]
    finally:
        asker.close()
        echo.close()
        relay.kill()


def _round_trips_s(asker: ZenohLink, n: int) -> list[float]:
    """Measure round trips of questions at the robot's control rate; no question waits for an answer."""
    trips_s: queue.SimpleQueue[float] = queue.SimpleQueue()
    pace = Rate(_QUESTION_S, threading.Event())
    for _ in range(n):
        pace.wait()

        def answered(data: bytes | None, asked_s: float = time.perf_counter()) -> None:
            trips_s.put(time.perf_counter() - asked_s if data is not None else math.nan)

        asker.ask(keys.REPORT, bytes(200), PATIENCE_S, answered)
    return [trip_s for trip_s in (trips_s.get(timeout=PATIENCE_S) for _ in range(n)) if math.isfinite(trip_s)]


def _commands_ms(sites: RealSites, delay_s: float, n: int) -> list[float]:
    """Measure a command's round trip beyond both delays [ms]."""
    for number in range(n):
        action, mode = ((Action.ARM, ControlMode.HOLD), (Action.DISARM, ControlMode.DISARMED))[number % 2]
        while not _done(sites, action, mode, number):
            pass  # refused: on a busy machine a command may come too late; retry as a person would
    return [1000.0 * (trip_s - 2.0 * delay_s) for trip_s in sites.console.picture.command_round_trips_s]


def _done(sites: RealSites, action: Action, mode: ControlMode, number: int) -> bool:
    """Give a command and see it done, or refused."""

    def refusals(picture: ConsoleState) -> int:
        return sum(notice.what == action and not notice.good for notice in picture.notices)

    def done(picture: ConsoleState) -> bool:
        answered = len(picture.command_round_trips_s) > number
        return answered and picture.mode is mode and not picture.pending

    sites.wait_for("control of the robot", lambda p: p.in_control)
    before = refusals(sites.console.picture)
    sites.console.submit(intents.CommandRobot(action))
    sites.wait_for(str(action), lambda p: done(p) or refusals(p) > before)
    return done(sites.console.picture)


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Tabulate medians beside their limits."""
    rows = []
    for result in results[0]["delays"]:
        transport, command = np.array(result["transport_ms"]), np.array(result["commands_ms"])
        rows.append(
            {
                "delay_s": result["delay_s"],
                "transport_p50_ms": float(np.median(transport)),
                "transport_p99_ms": float(np.quantile(transport, 0.99)),
                "relay_p50_ms": max(way["p50"] for way in result["relay_lateness_ms"].values()),
                "command_p50_ms": float(np.median(command)),
                "command_p99_ms": float(np.quantile(command, 0.99)),
                "demo": result["demo"],
                "n_questions": len(transport),
                "n_commands": len(command),
                "load": result["load"],
            }
        )
    passed = all(
        row["transport_p50_ms"] <= TRANSPORT_LIMIT_MS
        and row["command_p50_ms"] <= COMMAND_LIMIT_MS
        and row["demo"]["success"]
        for row in rows
    )
    lines = [
        "# What the software adds to the delay of the link",
        "",
        f"Limits of the medians: {TRANSPORT_LIMIT_MS:g} ms one way for relay and transport; {COMMAND_LIMIT_MS:g} ms "
        "(one control period + 3 ms) for a command's round trip beyond both delays. "
        f"{'All hold.' if passed else 'NOT all hold.'}",
        "",
        "| one way s | relay + transport p50 / p99 ms (n) | relay alone p50 ms | command beyond 2 x delay p50 / p99 ms (n) | planar job | load of the machine |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {r['delay_s']:g} | {r['transport_p50_ms']:.2f} / {r['transport_p99_ms']:.2f} ({r['n_questions']}) | "
        f"{r['relay_p50_ms']:.2f} | {r['command_p50_ms']:.1f} / {r['command_p99_ms']:.1f} ({r['n_commands']}) | "
        f"{'done' if r['demo']['success'] else 'FAILED'} | {r['load']:.1f} |"
        for r in rows
    ]
    lines += [
        "",
        f"Scheduled with {results[0]['scheduling']}; the load is the average of a minute, on {os.cpu_count()} cores.",
    ]
    return {"passed": passed, "delays": rows}, "\n".join(lines)
