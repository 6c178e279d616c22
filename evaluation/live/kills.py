"""Kills (SIGKILL) of either site at a random moment of an execution or of driving, with real processes.

The scripted operator of `farhand demo` does the job in a process of its own, over the real relay and TCP with 0.3 s one
way, and another site watches. At a random moment of the execution, or of the driving, the robot's site or the
operator's is killed. The rules that must hold then:

- the robot: its new boot is DISARMED, finds itself where it was, does not move, tells of the execution that was
  interrupted, and reports within 1.5 s and 6 ways after it is ready
- the operator, while the robot executes: the execution goes on to its end
- the operator, while it drives: the robot stands within 0.69 s and two ways, and is in HOLD then
- always: the operator's library is the same bit for bit; its next process has the model of before, shows the mode
  that the robot reports, and has the control of the robot back at once
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import time
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from farhand.common.errors import FarhandError
from farhand.common.mode_table import ControlMode, Phase
from farhand.common.wire.messages import PlannedPath, Telemetry, Wish
from farhand.common.wire.motion_encoding import duration_s
from farhand.deploy.places import find_task
from farhand.evaluation.harness.farhand_process import ReadyProcess
from farhand.evaluation.harness.real_sites import Heard, RealSites
from farhand.evaluation.link.link_delay import scheduling
from farhand.evaluation.link.link_recovery import limit_s
from farhand.evaluation.metrics.tables import rate, table
from farhand.evaluation.study import reporting_seeds
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.learning.warm_up import warm_up

Case = dict[str, Any]

_TASK = "hot-stab"
_MOMENTS = 20
_DELAY_S = 0.3
_DRIVEN_S = 1.2
_WATCHED_S = 1.0
_ARRIVAL_S = 120.0
# Tolerated silence, braking, two control periods, and a margin for this machine's own pauses.
_STANDS_S, _SLACK_S = 0.69, 0.25
_STILL_M = 1e-3
# The place is remembered 20 times a second and reported 25 times: the largest movement in between.
_MEANWHILE_S = 0.1
_KILLS = [("robot", "autonomous"), ("operator", "autonomous"), ("robot", "direct"), ("operator", "direct")]


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one kill per case; `trials` of each kind."""
    return [
        {
            "task": _TASK,
            "whom": whom,
            "mode": mode,
            "seed": each,
            "at": Random(f"{whom} {mode} {each}").random(),
        }
        for each in reporting_seeds(seed, trials or _MOMENTS)
        for whom, mode in _KILLS
    ]


def trial(case: Case) -> Case:
    """Run a job with a kill, and list what did not hold."""
    task = find_task(case["task"])
    warm_up(task.space, len(task.frame_names))  # not at the measured moment
    try:
        with RealSites(
            _DELAY_S, with_console=False, task=case["task"], seed=case["seed"], transport="tcp"
        ) as sites:
            broken = _kill(sites, case)
    except FarhandError as error:
        broken = [str(error)]
    return {**case, "broken": broken, "scheduling": scheduling(), "load": os.getloadavg()[0]}


def _kill(sites: RealSites, kill: Case) -> list[str]:
    """Do the job up to the moment, kill, and return the rules that did not hold."""
    with tempfile.TemporaryDirectory(prefix="farhand-watcher-") as folder:
        sites.open_console("watcher", Wish.WATCH, Path(folder))
        operator = sites.start_demo()
        try:
            _await_moment(sites, ControlMode(kill["mode"]), kill["at"])
            last, library = sites.heard[-1], _hash_of(sites.folder / kill["task"])
            if kill["whom"] == "robot":
                broken = _robot_killed(sites, last)
            else:
                broken = _operator_killed(sites, operator, kill["mode"])
        finally:
            operator.kill()
            sites.close_console()
    broken += _operator_again(sites, last.report)
    same = _hash_of(sites.folder / kill["task"]) == library
    return broken if same else [*broken, "the files of the operator's library are not the same"]


def _hash_of(folder: Path) -> str:
    """Hash every file in a folder by name and content."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return hashlib.sha256(b"".join(str(f).encode() + b"\0" + f.read_bytes() for f in files)).hexdigest()


def _await_moment(sites: RealSites, mode: ControlMode, at: float) -> None:
    if mode is ControlMode.AUTONOMOUS:
        # The robot goes to ready in this mode, too.
        sites.wait_for("the execution", lambda p: p.phase is Phase.APPROACHING and _executed(p) is not None)
        path = _executed(sites.console.picture)
        assert path is not None
        until_s = at * duration_s(path)
        sites.wait_for("the moment", lambda p: p.robot is not None and p.robot.elapsed_s >= until_s)
    else:
        sites.wait_for("the robot to be driven", lambda p: p.mode is mode)
        began_s = sites.heard[-1].sent_s
        sites.wait_until_heard("the moment", lambda heard: heard.sent_s >= began_s + at * _DRIVEN_S)


def _robot_killed(sites: RealSites, last: Heard) -> list[str]:
    ready_s = sites.restart_robot()
    first = sites.wait_until_heard("the new boot", lambda heard: heard.boot != last.boot)
    sites.wait_until_heard("it to go on", lambda heard: heard.sent_s >= first.sent_s + _WATCHED_S)
    reports = [heard.report for heard in sites.heard if heard.boot == first.boot]
    late_s = first.arrived_s - ready_s - limit_s("restart of the robot's site", _DELAY_S)
    away_m = _apart_m(last.report, first.report)
    most_m = 0.6 * (_MEANWHILE_S + 2.0 * _DELAY_S)
    broken = {
        "its first report came too late": late_s > 0.0,
        f"it is {away_m * 1e3:.0f} mm from where it was": away_m > most_m,
        "it is not DISARMED": any(report.mode is not ControlMode.DISARMED for report in reports),
        "it moves": any(_apart_m(first.report, report) > _STILL_M for report in reports),
    }
    # The reports in transit at the kill tell whether it had arrived meanwhile.
    final = [heard.report for heard in sites.heard if heard.boot == last.boot][-1]
    if final.mode is ControlMode.AUTONOMOUS and not final.phase.at_end:
        told = sites.console.wait_for(lambda p: _says(p, "interrupted"), 5.0)
        broken["it does not tell of the interruption"] = not told
    return [what for what, so in broken.items() if so]


def _operator_killed(sites: RealSites, operator: ReadyProcess, mode: str) -> list[str]:
    operator.kill()
    killed_s = time.monotonic()
    if mode == "autonomous":
        arrived = sites.console.wait_for(lambda p: p.phase.at_end, _ARRIVAL_S)
        return [] if arrived else ["the execution did not go on to its end"]
    stands_s = killed_s + _STANDS_S + 2.0 * _DELAY_S + _SLACK_S
    sites.wait_until_heard("it to stand", lambda heard: heard.arrived_s >= stands_s + _WATCHED_S)
    after = [heard.report for heard in sites.heard if heard.arrived_s >= stands_s]
    broken = {
        "it is not in HOLD": any(report.mode is not ControlMode.HOLD for report in after),
        "it moves": any(_apart_m(after[0], report) > _STILL_M for report in after),
    }
    return [what for what, so in broken.items() if so]


def _operator_again(sites: RealSites, before: Telemetry) -> list[str]:
    """Start the operator's next process, and check its library, its page and its control."""
    opened_s = sites.open_console()
    try:
        first = sites.wait_until_heard("a report", lambda heard: heard.arrived_s > opened_s)
        sites.wait_for("control of the robot", lambda p: p.in_control)
        picture = sites.console.picture
        learned = picture.learned
        broken = {
            "its first report came too late": first.arrived_s - opened_s > limit_s("restart", _DELAY_S),
            "it shows another mode": picture.mode is not sites.heard[-1].report.mode,
            "it has another model": before.model != ""
            and (learned is None or learned.sha256[: len(before.model)] != before.model),
        }
    finally:
        sites.close_console()
    return [f"the operator's next process: {what}" for what, so in broken.items() if so]


def _executed(picture: ConsoleState) -> PlannedPath | None:
    """Wait until the robot reports the path that it follows, and return its id."""
    path, robot = picture.path, picture.robot
    return path if path is not None and robot is not None and path.path_id == robot.path_id else None


def _says(picture: ConsoleState, what: str) -> bool:
    return any(notice.what == what for notice in picture.notices)


def _apart_m(one: Telemetry, other: Telemetry) -> float:
    return float(np.linalg.norm(np.subtract(one.position_m, other.position_m)))


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Count the kills after which every rule held, by site and mode."""
    wrong = [kill for kill in results if kill["broken"]]
    groups = [
        (f"{whom}, {mode.upper()}", [k for k in results if (k["whom"], k["mode"]) == (whom, mode)])
        for whom, mode in _KILLS
    ]
    rows = [(name, rate([not kill["broken"] for kill in part])) for name, part in [*groups, ("all", results)]]
    lines = ["# Either site killed", "", _TEXT, "", table(("killed", "every rule held"), rows), ""]
    lines += [
        f"- {k['whom']}, {k['mode']}, seed {k['seed']}, at {k['at']:.2f}, load {k['load']:.1f}: {'; '.join(k['broken'])}"
        for k in wrong
    ]
    loads = [kill["load"] for kill in results]
    lines += [
        "",
        f"Task {results[0]['task']}, two jobs at a time. Scheduled with {results[0]['scheduling']}; load of the machine "
        f"{np.median(loads):.1f} (median), {max(loads):.1f} (most).",
    ]
    return {"kills": len(results), "wrong": len(wrong), "passed": not wrong}, "\n".join(lines)


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()
