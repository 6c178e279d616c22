"""Several robots and operators through one hub: commands, routing, the narrow link's bytes, and a hub that is killed.

The hub is `farhand hub` in a process of its own, over QUIC with certificates or over TCP, all on this machine.

- commands: eight robots' processes (points) and four operators with the lease or a request for it at each; commands are timed
  until the robot has answered, in turn with those to a robot that listens without a hub, and the hub's processor time is read
- routing: the ends of eight robots and four operators exchange 10,000 messages of every kind that name robot and site; each
  end counts those that were for another one
- watchers: one robot behind a relay; the bytes that it carries in both directions with the site in control alone, and with four
  more sites that watch, all of them the shipped console
- restart: two robots, the first driven in DIRECT; the hub is killed and started again. The end of DIRECT is the time in
  the robot's own log; all are back once every site has a fresh report and an answer to a command
"""

from __future__ import annotations

import fcntl
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from farhand.common.errors import ProcessFailed
from farhand.common.link.endpoint import EVERY_SITE
from farhand.common.mode_table import Action
from farhand.common.task import TaskSet
from farhand.common.wire.messages import Wish
from farhand.deploy.pki.throw_away import Transport
from farhand.deploy.places import find_task
from farhand.evaluation.harness.hub_operator import PATIENCE_S, drive, return_s
from farhand.evaluation.harness.hub_sites import HubSites
from farhand.evaluation.harness.routing_ends import RobotEnd, SiteEnd
from farhand.evaluation.metrics.tables import table
from farhand.local_site.console.console import Console
from farhand.local_site.learning.warm_up import warm_up
from farhand.local_site.teaching.library import Library

Case = dict[str, Any]

ROBOTS = tuple(f"rov{k}" for k in range(1, 9))
OPERATORS = tuple(f"shore-{k}" for k in range(1, 5))
COMMANDS_S, HUB_CORE, BYTES, BACK_S, DIRECT_S = 0.020, 0.15, 1.05, 2.0, 0.8
"""Limits: commands p50 [s], share of a core, ratio of bytes, return after a restart, end of DIRECT with braking [s]."""
_KINDS = ("commands", "routing", "watchers", "restart")
_TRANSPORTS: tuple[Transport, ...] = ("quic", "tcp")
_COMMANDS, _MESSAGES, _WATCHED_S, _RESTARTS = 400, 10_000, 20, 10
_WATCHERS, _SETTLE_S, _PAUSE_S = 4, 5.0, 0.04
_EACH = {"commands": _COMMANDS, "routing": _MESSAGES, "watchers": _WATCHED_S, "restart": _RESTARTS}


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one case: concurrent ones would disturb each other; `trials` commands, messages, seconds and restarts."""
    runs = [(kind, transport) for transport in _TRANSPORTS for kind in _KINDS]
    return [
        {"run": kind, "transport": transport, "n": min(trials or _EACH[kind], _EACH[kind]), "seed": seed}
        for kind, transport in runs
    ]


def trial(case: Case) -> Case:
    """Measure one kind of run over one transport; one after the other, since they share the processors."""
    with _alone():
        return {**case, **_RUNS[case["run"]](case["transport"], case["n"]), "load": os.getloadavg()[0]}


def _commands(transport: Transport, n: int) -> Case:
    """Time commands of all operators to all robots, and read the hub's processor time meanwhile."""
    with HubSites(ROBOTS, OPERATORS, transport) as sites:
        sites.start_robots()
        ends, direct = sites.open_operators(), sites.open_direct()
        for end in (*ends, direct):
            end.until("a report", lambda _: True)
        time.sleep(_SETTLE_S)
        cpu_s, began_s = sites.hub_cpu_s(), time.monotonic()
        took_s, direct_s, unanswered = list[float](), list[float](), 0
        for k in range(n):
            end = ends[k * 5 % len(ends)]
            action = Action.ARM if k // len(ends) % 2 == 0 else Action.DISARM
            each_s, reply = end.command(action)
            took_s.append(each_s)
            unanswered += not end.is_answer(reply)
            direct_s.append(direct.command(action)[0])
            time.sleep(_PAUSE_S)
        core = (sites.hub_cpu_s() - cpu_s) / (time.monotonic() - began_s)
        boots = [
            {end.newest.stamp.boot for end in ends if end.robot == robot and end.newest} for robot in ROBOTS
        ]
    distinct = all(len(each) == 1 for each in boots) and len(set().union(*boots)) == len(ROBOTS)
    return {
        "took_s": took_s,
        "directly_s": direct_s,
        "unanswered": unanswered,
        "core": core,
        "each_hears_its_own": distinct,
    }


def _routing(transport: Transport, n: int) -> Case:
    """Exchange messages that name robot and site, and count those that arrived at another one."""
    with HubSites(ROBOTS, OPERATORS, transport) as sites:
        names = [(robot, EVERY_SITE) for robot in ROBOTS]
        robots = [RobotEnd(link, robot) for link, robot in zip(sites.links(names), ROBOTS, strict=True)]
        pairs = [(robot, site) for robot in ROBOTS for site in OPERATORS]
        ends = [SiteEnd(link, *pair) for link, pair in zip(sites.links(pairs), pairs, strict=True)]
        for end in ends:
            end.ask_until_answered()
        # A round of each pair: a question with its answer, an input, and an eighth of the robots' reports and events.
        rounds = 0
        while (arrived := sum(end.arrived for end in (*robots, *ends))) < n:
            rounds += 1
            for end in ends:
                end.speak()
            for robot in robots:
                robot.speak()
            if rounds > n:
                raise ProcessFailed("the messages do not arrive")
        time.sleep(0.5)
        wrong = sum(end.wrong for end in (*robots, *ends))
    return {"arrived": arrived, "wrong": wrong}


def _watchers(transport: Transport, n: int) -> Case:
    """Return the bytes a second on the robot's link with the site in control alone, and with watchers beside it."""
    names = ("shore-1", *(f"watcher-{k}" for k in range(1, _WATCHERS + 1)))
    task = find_task("planar")
    warm_up(task.space, len(task.frame_names))
    with HubSites(ROBOTS[:1], names, transport) as sites, ExitStack() as stack:
        control = sites.start_relay()
        sites.start_robots(through_relay=True)

        def carried_bytes() -> int:
            ways = control.status()
            return sum(ways[way]["delivered_bytes"] for way in ("uplink", "downlink"))

        def measured() -> float:
            time.sleep(_SETTLE_S)
            before, began_s = carried_bytes(), time.monotonic()
            time.sleep(n)
            return (carried_bytes() - before) / (time.monotonic() - began_s)

        def open_console(name: str, wish: Wish, ready: Callable[[Any], bool]) -> None:
            library = Library(TaskSet([task]), sites.folder / name)
            (link,) = sites.links([(ROBOTS[0], name)])
            console = Console(library, link, name, wish=wish)
            stack.callback(console.close)
            console.start()
            if not console.wait_for(ready, PATIENCE_S):
                raise ProcessFailed(f"{name} waited {PATIENCE_S:.0f} s for the robot")

        open_console(names[0], Wish.CONTROL, lambda state: state.in_control)
        alone = measured()
        for name in names[1:]:
            open_console(name, Wish.WATCH, lambda state: state.robot is not None)
        return {"alone_bytes_s": alone, "watched_bytes_s": measured()}


def _restart(transport: Transport, n: int) -> Case:
    """Kill the hub while a robot is driven, start it again, and time the end of DIRECT and the return of all."""
    direct_s, back_s, went_on = list[float](), list[float](), True
    with HubSites(ROBOTS[:2], OPERATORS[:2], transport) as sites:
        sites.start_robots()
        ends = sites.open_operators()
        for _ in range(n):
            boots = {end.robot: end.until("a report", lambda _: True).stamp.boot for end in ends}
            driver = drive(ends, ROBOTS[0])
            before = len(sites.robot_events(driver.robot).read_text("utf-8").splitlines())
            time.sleep(_SETTLE_S / 2.0)
            killed_s = time.time()
            sites.hub.kill()
            time.sleep(2.0)
            direct_s.append(sites.held_s(driver.robot, before) - killed_s)
            back_s.append(return_s(ends, sites.start_hub()))
            went_on &= all(
                end.newest is not None and end.newest.stamp.boot == boots[end.robot] for end in ends
            )
    return {"direct_s": direct_s, "back_s": back_s, "went_on": went_on}


@contextmanager
def _alone() -> Iterator[None]:
    """Wait until no other trial of this study runs: they share the processors that they measure."""
    with (Path(tempfile.gettempdir()) / f"farhand-hub-study-{os.getuid()}").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


_RUNS: dict[str, Callable[[Transport, int], Case]] = {
    "commands": _commands, "routing": _routing, "watchers": _watchers, "restart": _restart,
}  # fmt: skip


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Hold each run against its limits."""
    rows = [
        (r["run"], r["transport"], *_judged(r)[:2], "yes" if _judged(r)[2] else "no", f"{r['load']:.1f}")
        for r in results
    ]
    header = ("run", "over", "measured", "limit", "kept", "load")
    summary = {f"{result['run']}, {result['transport']}": _judged(result)[0] for result in results}
    passed = all(_judged(result)[2] for result in results)
    lines = ["# Several robots through one hub", "", _TEXT, "", table(header, rows)]
    return {**summary, "passed": passed}, "\n".join(lines)


def _judged(result: Case) -> tuple[str, str, bool]:
    """Return what was measured, its limit, and whether it is kept."""
    match result["run"]:
        case "commands":
            p50, p95 = np.quantile(result["took_s"], (0.5, 0.95))
            measured = (
                f"{len(result['took_s'])} commands, p50 {1e3 * p50:.1f} ms, p95 {1e3 * p95:.1f} ms "
                f"(without a hub p50 {1e3 * np.median(result['directly_s']):.1f} ms), "
                f"{result['unanswered']} unanswered, hub {100 * result['core']:.1f} % of a core"
            )
            kept = p50 <= COMMANDS_S and result["core"] <= HUB_CORE and not result["unanswered"]
            limit = f"p50 {1e3 * COMMANDS_S:.0f} ms, hub {100 * HUB_CORE:.0f} %"
            return measured, limit, bool(kept and result["each_hears_its_own"])
        case "routing":
            return f"{result['wrong']} of {result['arrived']} at a wrong end", "0", not result["wrong"]
        case "watchers":
            ratio = result["watched_bytes_s"] / result["alone_bytes_s"]
            measured = f"{ratio:.3f} x, from {result['alone_bytes_s'] / 1e3:.1f} kB/s"
            return measured, f"{BYTES:g} x", ratio <= BYTES
        case _:
            direct_s, back_s = max(result["direct_s"]), max(result["back_s"])
            measured = f"{len(result['back_s'])} kills: DIRECT ended in {direct_s:.2f} s, all back in {back_s:.2f} s at most"
            kept = direct_s <= DIRECT_S and back_s <= BACK_S and result["went_on"]
            return measured, f"{DIRECT_S:g} s with braking, {BACK_S:g} s", kept


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()
