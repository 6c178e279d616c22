"""Certificates that are renewed, and an operator that is revoked, while the robot executes.

The robot is a process with a list of sites, over QUIC through the real relay with 0.3 s one way; the console is the shipped one in
this process, with the scripted operator of `farhand demo`. At a random moment of the execution

- renewed: the certificates of the robot and of the operator are replaced by renewed ones, and the job must go on to its end
- revoked: the operator is revoked. The robot must execute to the end and arrive. The operator is out when its last
  report has arrived, and must be told why: by the words that its page shows

The robot must not leave AUTONOMOUS before its execution has ended.
"""

from __future__ import annotations

import json
import random
import shutil
import time
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np

from farhand.common.errors import FarhandError, ProcessFailed
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.mode_table import ControlMode
from farhand.common.task import TaskSet
from farhand.common.wire.reason_words import sentence
from farhand.deploy.places import find_task
from farhand.evaluation.harness.real_sites import PATIENCE_S, RealSites
from farhand.evaluation.metrics.tables import rate, table
from farhand.evaluation.study import by_value, reporting_seeds
from farhand.local_site.exchange.rights import RightsWatch
from farhand.local_site.script.scripted_actions import JobFailed
from farhand.local_site.script.scripted_operator import ScriptedOperator

Case = dict[str, Any]

KINDS = ("renewed", "revoked")
OUT_S = 1.0
"""Longest time from the revocation until the operator hears nothing more [s]."""
_TRIALS, _AT_ONCE, _WAY_S, _DAYS, _LATEST_S = 20, 3, 0.3, 30, 2.0
_TASK, _SITE, _ROBOT = "planar", "operator", EndpointSettings().vehicle


def cases(trials: int | None, seed: int) -> list[Case]:
    """List both kinds, each with its own seeds; a process runs some of them at a time. `--only` takes a kind."""
    n = trials or _TRIALS
    seeds = list(reporting_seeds(seed, 2 * n))
    return [{"kind": kind, "seeds": seeds[i * n : (i + 1) * n]} for i, kind in enumerate(KINDS)]


def trial(case: Case) -> Case:
    """Run the jobs of one kind, some at a time: they mostly wait."""
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        jobs = pool.map(lambda seed: job(case["kind"], seed), case["seeds"])
        return {"kind": case["kind"], "jobs": list(jobs)}


def job(kind: str, seed: int) -> Case:
    """Do the job once, and change the certificates during its execution.

    Args:
        kind: One of `KINDS`.
        seed: Seed of the hand and of the moment.
    """
    found: Case = {"seed": seed, "finished": False, "left": [], "out_s": None, "said": "", "why": ""}
    try:
        with (
            RealSites(
                _WAY_S, with_console=False, task=_TASK, seed=seed, transport="quic", listed=True
            ) as sites,
            ThreadPoolExecutor(1) as pool,
        ):
            sites.open_console(_SITE)
            rights = RightsWatch(sites.link, _SITE, _ROBOT, sites.console.is_served, sites.console.refused)
            try:
                script = ScriptedOperator(
                    sites.console, TaskSet([find_task(_TASK)]), sites.control, None, seed
                )
                done = pool.submit(script.run)
                _until_executing(sites, done)
                time.sleep(random.Random(seed).uniform(0.0, _LATEST_S))
                found |= _renew(sites, done) if kind == "renewed" else _revoke(sites, done)
                found |= _execution(sites)
            finally:
                rights.close()
                sites.close_console()
    except FarhandError as error:
        found["why"] = str(error)
    return found


def _until_executing(sites: RealSites, done: Future[Any]) -> None:
    """Wait until the robot executes.

    Raises:
        FarhandError: When the job was over before.
    """
    sites.wait_for("the execution", lambda p: p.mode is ControlMode.AUTONOMOUS or done.done())
    if done.done():
        done.result()
        raise ProcessFailed("the job was over before the execution was seen")


def _renew(sites: RealSites, done: Future[Any]) -> Case:
    before = sites.control.status()["accepted"]
    for name in (_ROBOT, _SITE):
        sites.registry.renew(name, _DAYS)
    success = done.result()["success"]
    if sites.control.status()["accepted"] == before:
        return {"finished": False, "why": "no connection was made with the renewed certificates"}
    return {"finished": success, "why": "" if success else "the error was too large"}


def _revoke(sites: RealSites, done: Future[Any]) -> Case:
    folder = sites.registry.folder_of(_SITE)
    kept = shutil.copytree(folder, sites.folder / "kept")
    revoked_s = time.monotonic()
    sites.registry.revoke(_SITE)
    for (
        file
    ) in kept.iterdir():  # a revocation deletes the authority's copy of the key: the operator has its own
        shutil.copy(file, folder)
    try:
        done.result()
    except JobFailed:
        said = sentence(sites.console.picture.why_not_in_control)
        return {"finished": True, "out_s": sites.heard[-1].arrived_s - revoked_s, "said": said}
    return {"why": "the revoked operator did the job to its end"}


def _execution(sites: RealSites) -> Case:
    """Wait for the end of the robot's execution; return whether it arrived, and which modes it took before."""
    until_s, end, events = time.monotonic() + PATIENCE_S, [], []
    while not end and time.monotonic() < until_s:
        lines = sites.robot_events.read_text("utf-8").splitlines(keepends=True)
        events = [json.loads(line) for line in lines if line.endswith("\n")]
        end = [e for e in events if e.get("action") == "execute" and e["kind"] in ("completed", "failed")]
        time.sleep(0.0 if end else 0.1)
    kinds = [event["kind"] for event in events]
    begun = kinds.index("executing") if "executing" in kinds else len(kinds)
    meanwhile = kinds[begun : events.index(end[0])] if end else kinds[begun:]
    left = [kind for kind in meanwhile if kind in ("disarmed", "stopped", "paused", "failed")]
    return {"left": left} if end and end[0]["succeeded"] else {"left": left, "finished": False}


def _holds(kind: str, found: Case) -> bool:
    if not found["finished"] or found["left"] or found["why"]:
        return False
    return kind == "renewed" or (found["out_s"] <= OUT_S and "revoked" in found["said"])


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Count the jobs in which every rule held."""
    rows, failures = [], []
    for kind, (result,) in by_value(results, "kind", KINDS).items():
        held = [_holds(kind, each) for each in result["jobs"]]
        out_s = [each["out_s"] for each in result["jobs"] if each["out_s"] is not None]
        out = f"{np.median(out_s):.2f} / {max(out_s):.2f}" if out_s else "-"
        rows.append((kind, rate(held), out))
        failures += [
            f"- {kind}, seed {each['seed']}: {each['why'] or each}"
            for each, good in zip(result["jobs"], held, strict=True)
            if not good
        ]
    text = (__doc__ or "").split("\n", 1)[1].strip()
    header = ("certificate", "every rule held", f"out after s, median / worst (limit {OUT_S:g})")
    lines = [
        "# Certificates that change during an execution",
        "",
        text,
        "",
        table(header, rows),
        "",
        *failures,
    ]
    return {"passed": not failures}, "\n".join(lines).rstrip()
