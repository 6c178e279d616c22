"""Bad peers of a robot with certificates: no command of theirs runs, and both sides say why they are refused.

A robot's process listens over QUIC behind the simulated link `geo`, with a list of an operator and an observer; another
one, which nobody speaks to, shows what the machine costs. Each bad peer tries once: without a certificate, with
one of another authority, expired, not valid yet; under another name than the robot's; an observer that commands; an
operator of another robot; on another's key; with messages of 200 kB; a thousand malformed messages a second; one
connection too many; over plain TCP. The site's reason is what `farhand local` would print, the robot's is in its log.
Beside floods an operator sends stops.
"""

from __future__ import annotations

import contextlib
import re
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from farhand.common.address import free_port
from farhand.deploy.pki.registry import Registry
from farhand.evaluation.harness.bad_peers import DAYS, FLOOD_S, PEERS, REASON_S, ROBOT, Bench
from farhand.evaluation.harness.farhand_process import HOST, HeardProcess, ReadyProcess
from farhand.evaluation.live.neighbours import Stopping
from farhand.evaluation.live.tick import tick_lines
from farhand.evaluation.metrics.tables import table

Case = dict[str, Any]

ONE_AT_A_TIME = True

_TRIALS, _STOPS = 20, 10
"""Tries of each peer, and the operator's stops while a flood lasts."""
_FLOODS = ("200 kB", "1 kHz")


def cases(trials: int | None, seed: int) -> list[Case]:
    """List each peer."""
    del seed  # nothing here is random
    return [{"peer": name, "trials": trials or _TRIALS} for name in PEERS]


def trial(case: Case) -> Case:
    """Let the peer try, each time against a new robot."""
    return {**case, "tries": [_try(case["peer"]) for _ in range(case["trials"])]}


def _try(name: str) -> Case:
    """Let a peer try against a new robot; count what ran, and the periods that this robot and an idle one left out."""
    with tempfile.TemporaryDirectory(prefix="farhand-bad-peers-") as scratch:
        folder = Path(scratch)
        with bench_in(folder) as (bench, robot):
            found = attempt(bench, robot, name)
            robot.end()
        events, idle = (folder / which / "robot" / ROBOT / "events.jsonl" for which in ("robot", "idle"))
        return {
            **found, "ran": commands_run(events),
            "left_out": tick_lines(events)[-1]["overruns"], "left_out_idle": tick_lines(idle)[-1]["overruns"],
        }  # fmt: skip


def attempt(bench: Bench, robot: HeardProcess, name: str, patience_s: float = REASON_S) -> Case:
    """Let a peer try once; return which sides have said the reason, and how long stops took meanwhile [s].

    Args:
        bench: Relay before the robot.
        robot: The robot.
        name: Name of the peer.
        patience_s: Longest wait for the robot's reason [s].
    """
    act, at_site, at_robot = PEERS[name]
    from_s = time.monotonic()
    with ThreadPoolExecutor(1) as pool:
        stops = pool.submit(_stops_s, bench) if name in _FLOODS else None
        said = act(bench)
        took_s = stops.result() if stops is not None else []
    until_s = max(time.monotonic() + 1.0, from_s + patience_s)
    while at_robot and at_robot not in robot.words and time.monotonic() < until_s:
        time.sleep(0.1)
    return {"site": at_site in said, "robot": at_robot in robot.words, "said": said, "stops_s": took_s}


def commands_run(events: Path) -> int:
    """Count the commands that a robot has done, and the sites that got control of it, by its event log."""
    return len(re.findall(r'"kind": ?"(completed|executing|control)"', events.read_text("utf-8")))


def _stops_s(bench: Bench) -> list[float | None]:
    """Send stops as an operator while a flood lasts; return how long each acknowledgement took [s]."""
    operator = Stopping(bench.settings("shore-1"))
    try:
        return operator.stop(_STOPS, FLOOD_S)
    finally:
        operator.close()


@contextlib.contextmanager
def bench_in(folder: Path, profile: str = "geo") -> Iterator[tuple[Bench, HeardProcess]]:
    """Start the robot, an idle one and the relay, until the end of the block.

    Args:
        folder: Folder of all files.
        profile: Profile of the link.
    """
    registry, port = Registry.create(folder / "pki", "fleet"), free_port("quic")
    robot = registry.issue(ROBOT, "robot", (HOST,), DAYS)
    registry.issue("shore-1", "operator", (), DAYS)
    registry.issue("watcher", "observer", (), DAYS)
    sites = folder / "sites.json"
    sites.write_bytes((folder / "pki" / "sites.json").read_bytes())
    with contextlib.ExitStack() as closing:
        idle = ReadyProcess(
            "remote", "--task=planar", f"--listen=tcp/{HOST}:{free_port()}", f"--data-dir={folder / 'idle'}"
        )
        closing.callback(idle.end)
        heard = HeardProcess(
            "remote", "--task=planar", f"--listen=quic/{HOST}:{port}", f"--certificates={robot}", f"--sites={sites}",
            f"--data-dir={folder / 'robot'}",
        )  # fmt: skip
        closing.callback(heard.kill)
        heard.until("the robot is ready")
        relay = ReadyProcess(
            "link",
            f"--listen={HOST}:0",
            f"--target={HOST}:{port}",
            f"--control={HOST}:0",
            f"--profile={profile}",
        )
        closing.callback(relay.kill)
        yield Bench(folder, registry, relay.ready["port"]), heard


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Count reasons, commands and lost periods."""
    rows, passed = [], True
    for result in results:
        tries, (_, at_site, at_robot) = result["tries"], PEERS[result["peer"]]
        n, ran = len(tries), sum(each["ran"] for each in tries)
        said = [sum(each[side] for each in tries) for side in ("site", "robot")]
        lost = [sum(each[side] for each in tries) for side in ("left_out", "left_out_idle")]
        stops_s = [took_s for each in tries for took_s in each["stops_s"]]
        answered = all(took_s is not None for took_s in stops_s)
        passed &= ran == 0 and min(said) >= 0.95 * n and answered
        rows.append(
            (result["peer"], n, ran, f"{said[0]} of {n}" if at_site else "-", f"{said[1]} of {n}" if at_robot else "-",
             f"{lost[0]} / {lost[1]}", f"{max(stops_s):.2f}" if stops_s and answered else "-" if answered else "NOT ANSWERED")
        )  # fmt: skip
    header = (
        "peer", "tries", "commands run", "the site says why", "the robot says why",
        "control periods left out, beside an idle robot's", "slowest stop of an operator meanwhile s",
    )  # fmt: skip
    text = ["# Bad peers", "", (__doc__ or "").split("\n", 1)[1].strip(), "", table(header, rows)]
    return {"passed": passed, "peers": [row[0] for row in rows]}, "\n".join(text)
