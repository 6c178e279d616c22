"""Delivery by kind on a link that loses datagrams: age of reports, answers to commands, confirmation of stops.

Robot and link are processes, the console is the shipped one, 0.3 s one way. Over QUIC each datagram is lost with the
given chance in each direction; over TLS the relay loses nothing, as TCP repairs that itself: its figures are what TCP
does without loss. Arm and Disarm in turn are timed until answered, stops until the robot has said that it received them.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from farhand.common.control_mode import Action, ControlMode
from farhand.deploy.pki.throw_away import Transport
from farhand.evaluation.harness.real_sites import Heard, RealSites
from farhand.evaluation.link.link_delay import scheduling
from farhand.evaluation.metrics.tables import table
from farhand.local_site.console import intents

Case = dict[str, Any]

WAY_S = 0.3
LIMITS: dict[float, tuple[float, float, float, float]] = {
    10.0: (0.33, 0.65, 1.30, 1.0),
    20.0: (0.35, np.inf, np.inf, np.inf),
}
"""By the loss [%]: age of reports p95, commands p50 and p95, stops p99 [s]."""
_COMMANDS, _STOPS = 100, 200
_SETTLE_S, _RESET_S = 8.0, 4.0
_WAYS = ("uplink", "downlink")
_RUNS: tuple[tuple[Transport, float], ...] = (
    ("tls", 0.0),
    ("quic", 0.0),
    ("quic", 5.0),
    ("quic", 10.0),
    ("quic", 20.0),
)


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one case: concurrent ones would disturb each other."""
    return [{"commands": trials or _COMMANDS, "stops": trials or _STOPS, "seed": seed, "runs": _RUNS}]


def trial(case: Case) -> Case:
    """Measure each transport and loss in turn."""
    runs = [measure(transport, loss, case) for transport, loss in case["runs"]]
    return {**case, "measured": runs, "scheduling": scheduling()}


def measure(transport: Transport, loss: float, case: Case) -> Case:
    """Measure one transport at one loss."""
    with RealSites(WAY_S, transport=transport) as sites:
        way = {"loss": loss, "seed": case["seed"]}
        sites.control.set(uplink=way, downlink=way)
        sites.wait_for("control of the robot", lambda p: p.in_control)
        time.sleep(_SETTLE_S)  # the loss becomes known; an event that says so does not cross the link
        first, before = len(sites.heard), sites.control.status()
        began_s = time.monotonic()
        commands_s = _commands_s(sites, case["commands"])
        stops_s = [stop_s(sites) for _ in range(case["stops"])]
        heard, took_s = sites.heard[first:], time.monotonic() - began_s
        ways = sites.control.status()
    return {
        "transport": transport,
        "loss": loss,
        "age_s": [each.arrived_s - each.sent_s for each in heard],
        "missed": _missed(heard),
        "reports_hz": len(heard) / took_s,
        "commands_s": commands_s,
        "stops_s": stops_s,
        "bytes_s": {
            name: (ways[name]["delivered_bytes"] - before[name]["delivered_bytes"]) / took_s for name in _WAYS
        },
    }


def _commands_s(sites: RealSites, n: int) -> list[float]:
    """Time commands until they are answered [s]; one that is refused as too late counts like any other."""
    for number in range(n):
        mode = sites.console.picture.mode
        action = Action.DISARM if mode is not ControlMode.DISARMED else Action.ARM
        sites.console.submit(intents.CommandRobot(action))
        sites.wait_for(f"the answer to {action}", lambda p, n=number: len(p.command_round_trips_s) > n)
        sites.wait_for(f"the end of {action}", lambda p, before=mode: not p.pending and p.mode is not before)
    return list(sites.console.picture.command_round_trips_s)


def stop_s(sites: RealSites) -> float:
    """Press STOP and return the time until the robot has confirmed it; then reset the robot."""
    pressed_s = time.monotonic()
    sites.console.submit(intents.CommandRobot(Action.STOP))
    sites.wait_for("the confirmation", lambda p: p.stop is not None and p.stop.received)
    took_s = time.monotonic() - pressed_s
    sites.wait_for("the stop", lambda p: p.stop is not None and p.stop.settled)
    while sites.console.picture.mode is ControlMode.STOPPED:
        sites.console.submit(intents.CommandRobot(Action.RESET))
        sites.console.wait_for(lambda p: p.mode is not ControlMode.STOPPED, _RESET_S)  # else again
    return took_s


def _missed(heard: list[Heard]) -> float:
    """Return the share of reports between the first and the last that did not arrive."""
    numbers = [each.report.seq for each in heard]
    return 1.0 - len(numbers) / (numbers[-1] - numbers[0] + 1) if numbers else 1.0


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Tabulate quantiles beside their limits."""
    rows, lines, passed = [], [], True
    for run in results[0]["measured"]:
        age, commands, stops = (np.array(run[key]) for key in ("age_s", "commands_s", "stops_s"))
        found = (
            float(np.quantile(age, 0.95)), float(np.median(commands)), float(np.quantile(commands, 0.95)),
            float(np.quantile(stops, 0.99)),
        )  # fmt: skip
        limits = LIMITS.get(run["loss"], (np.inf,) * 4)
        holds = all(value <= limit for value, limit in zip(found, limits, strict=True))
        passed &= holds
        rows.append({"transport": run["transport"], "loss": run["loss"], "found_s": found, "holds": holds})
        lines.append(
            (f"{run['transport']}, {run['loss']:g} %", f"{np.median(age):.3f} / {found[0]:.3f}", f"{run['reports_hz']:.1f}",
             f"{found[1]:.2f} / {found[2]:.2f}", f"{np.median(stops):.2f} / {found[3]:.2f}", "yes" if holds else "NO")
        )  # fmt: skip
    text = [
        "# Delivery on a lossy link", "", (__doc__ or "").split("\n", 1)[1].strip(), "",
        table(("datagrams lost each way", "report: age on arrival p50 / p95 s", "reports a second",
               "command answered p50 / p95 s", "stop confirmed p50 / p99 s", "within the limits"), lines),
        "", f"{results[0]['commands']} commands and {results[0]['stops']} stops each. Scheduled with {results[0]['scheduling']}.",
    ]  # fmt: skip
    return {"passed": passed, "runs": rows}, "\n".join(text)
