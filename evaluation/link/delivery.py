"""Delivery by kind on a link that loses datagrams: reports, commands, stops; outages; whole jobs.

Robot and link are processes, the console is the shipped one, 0.3 s one way. Over QUIC each datagram is lost with the
given chance in each direction; over TLS the relay loses nothing, as TCP repairs that itself: its figures are what TCP
does without loss. Arm and Disarm in turn are timed until answered, stops until the robot has said that it received them.
In an outage all datagrams are lost; it begins 8 s after the one before. Data is fresh when it is not older than usual by more than 0.1 s. A job is that of `farhand
demo`, with the plug. `--only` takes a line of the tables, such as `--only "quic, 10 %"`.
"""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import numpy as np

from farhand.common.mode_table import Action, ControlMode
from farhand.deploy.pki.throw_away import Transport
from farhand.evaluation.harness.real_sites import Heard, RealSites
from farhand.evaluation.link.link_delay import scheduling
from farhand.evaluation.link.outages_and_loss import (
    LOSSES,
    OUTAGES_S,
    WAY_S,
    fresh_after_s,
    fresh_limit_s,
    job,
)
from farhand.evaluation.metrics.tables import table
from farhand.evaluation.study import reporting_seeds
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.notices import Notice

Case = dict[str, Any]

ONE_AT_A_TIME = True
LIMITS: dict[float, tuple[float, float, float, float]] = {
    10.0: (0.33, 0.65, 1.30, 1.0),
    20.0: (0.35, np.inf, np.inf, np.inf),
}
"""By the loss [%]: age of reports p95, commands p50 and p95, stops p99 [s]."""
_COMMANDS, _STOPS, _OUTAGES, _JOBS = 100, 200, 20, 10
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
    """List each transport and loss, each outage, and each kind of job."""
    measured = [
        {"what": f"{transport}, {loss:g} %", "transport": transport, "loss": loss, "seed": seed,
         "commands": trials or _COMMANDS, "stops": trials or _STOPS}
        for transport, loss in _RUNS
    ]  # fmt: skip
    outages = [{"what": f"outage of {s:g} s", "outage_s": s, "n": trials or _OUTAGES} for s in OUTAGES_S]
    seeds = reporting_seeds(seed, trials or _JOBS)
    jobs = [{"what": f"job, {loss}", "loss_kind": loss, "seeds": list(seeds)} for loss in LOSSES]
    return [*measured, *outages, *jobs]


def trial(case: Case) -> Case:
    """Measure one of them."""
    if "outage_s" in case:
        found: Case = {"took_s": fresh_after_s(case["outage_s"], case["n"])}
    elif "seeds" in case:
        found = {"jobs": [job(case["loss_kind"], seed) for seed in case["seeds"]]}
    else:
        found = measure(case["transport"], case["loss"], case)
    return {**case, **found, "scheduling": scheduling()}


def measure(transport: Transport, loss: float, case: Case) -> Case:
    """Measure one transport at one loss."""
    with RealSites(WAY_S, transport=transport) as sites:
        way = {"loss": loss, "seed": case["seed"]}
        sites.control.set(uplink=way, downlink=way)
        sites.wait_for("control of the robot", lambda p: p.in_control)
        time.sleep(_SETTLE_S)  # the loss becomes known; an event that says so does not cross the link
        first, before = len(sites.heard), sites.control.status()
        began_s = time.monotonic()
        commands_s, n_refused = _commands_s(sites, case["commands"])
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
        "refused": n_refused,
        "stops_s": stops_s,
        "bytes_s": {
            name: (ways[name]["delivered_bytes"] - before[name]["delivered_bytes"]) / took_s for name in _WAYS
        },
    }


def _commands_s(sites: RealSites, n: int) -> tuple[list[float], int]:
    """Time commands until they are answered [s], also by a refusal as too late; count those refusals."""
    took_s, n_refused = [], 0
    for _ in range(n):
        sites.wait_for("control of the robot", lambda p: p.in_control)
        before = sites.console.picture
        action = Action.DISARM if before.mode is not ControlMode.DISARMED else Action.ARM
        asked_s = time.monotonic()
        sites.console.submit(intents.CommandRobot(action))
        answered = partial(_is_answered, before, action)
        sites.wait_for(f"the answer to {action}", answered)
        took_s.append(time.monotonic() - asked_s)
        if _is_accepted(before, sites.console.picture):
            sites.wait_for(
                f"the end of {action}", lambda p, old=before: not p.pending and p.mode is not old.mode
            )
        else:
            n_refused += 1
    return took_s, n_refused


def _is_answered(before: ConsoleState, action: Action, now: ConsoleState) -> bool:
    return _is_accepted(before, now) or _refusal(action, now) is not _refusal(action, before)


def _is_accepted(before: ConsoleState, now: ConsoleState) -> bool:
    return len(now.command_round_trips_s) > len(before.command_round_trips_s)


def _refusal(action: Action, picture: ConsoleState) -> Notice | None:
    """Return the newest refusal of an action."""
    return next((each for each in reversed(picture.notices) if each.what == action and not each.good), None)


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
    """Tabulate what was measured beside its limits."""
    groups = (
        (("datagrams lost each way", "report: age on arrival p50 / p95 s", "reports a second", "missing",
          "command answered p50 / p95 s", "refused", "stop confirmed p50 / p99 s", "there / back B/s", "within the limits"),
         [_measured(each) for each in results if "age_s" in each]),
        (("outage", "n", "fresh data after, median s", "worst s", "limit s", "within the limit"),
         [_outage(each) for each in results if "took_s" in each]),
        (("job", "done", "failures"), [_jobs(each) for each in results if "jobs" in each]),
    )  # fmt: skip
    text = ["# Delivery on a lossy link", "", (__doc__ or "").split("\n", 1)[1].strip()]
    passed = True
    for header, rows in groups:
        passed &= all(holds for holds, _ in rows)
        text += ["", table(header, [row for _, row in rows])] if rows else []
    text += ["", f"Scheduled with {results[0]['scheduling']}."]
    return {"passed": passed}, "\n".join(text)


def _measured(run: Case) -> tuple[bool, tuple[object, ...]]:
    age, commands, stops = (np.array(run[key]) for key in ("age_s", "commands_s", "stops_s"))
    found = (
        float(np.quantile(age, 0.95)), float(np.median(commands)), float(np.quantile(commands, 0.95)),
        float(np.quantile(stops, 0.99)),
    )  # fmt: skip
    limits = LIMITS.get(run["loss"], (np.inf,) * 4)
    holds = all(value <= limit for value, limit in zip(found, limits, strict=True))
    return holds, (
        run["what"], f"{np.median(age):.3f} / {found[0]:.3f}", f"{run['reports_hz']:.1f}", f"{100 * run['missed']:.0f} %",
        f"{found[1]:.2f} / {found[2]:.2f}", run["refused"], f"{np.median(stops):.2f} / {found[3]:.2f}",
        " / ".join(f"{run['bytes_s'][way]:.0f}" for way in _WAYS), _yes(holds),
    )  # fmt: skip


def _outage(run: Case) -> tuple[bool, tuple[object, ...]]:
    took_s, limit_s = run["took_s"], fresh_limit_s(run["outage_s"])
    holds = max(took_s) <= limit_s
    return holds, (
        run["what"], len(took_s), f"{np.median(took_s):.2f}", f"{max(took_s):.2f}", f"{limit_s:.2f}", _yes(holds),
    )  # fmt: skip


def _jobs(run: Case) -> tuple[bool, tuple[object, ...]]:
    done = [each["success"] for each in run["jobs"]]
    why = "; ".join(f"seed {each['seed']}: {each['why']}" for each in run["jobs"] if not each["success"])
    return all(done), (run["what"], f"{sum(done)} of {len(done)}", why or "-")


def _yes(holds: bool) -> str:
    return "yes" if holds else "NO"
