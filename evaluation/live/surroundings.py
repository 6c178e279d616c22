"""Commands started in unusual surroundings: each works, or says in one line what would help.

Each trial starts a real process: `up`, `demo`, `local`, `remote`, `link`, `learn`, `rollout` or `import`, in one of
the surroundings (users, disks, folders, descriptors, terminals, networks; two at once; Ctrl-C at twenty moments of
the start). What starts a site is awaited until it is ready and then ended by Ctrl-C; what works on files must write
what it writes elsewhere. A page is opened through a proxy that rewrites the name under which it was asked for, and that
the configuration names, or not. Otherwise a command must end with one line that begins with `farhand: `, and with a status that is
not success. A traceback, a second line, or silence for three minutes is a fault.

Trials that only root can arrange are skipped for others, and counted.
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from farhand.common.address import free_port
from farhand.common.model.model_file import encode
from farhand.deploy.places import sample_files
from farhand.evaluation.harness.farhand_process import HOST, ReadyProcess
from farhand.evaluation.harness.page_visitor import reverse_proxy, visit
from farhand.evaluation.harness.started import ProcessOutcome, started
from farhand.evaluation.harness.surrounding import NAMED, SURROUNDINGS, Surrounding
from farhand.evaluation.metrics.tables import table
from farhand.local_site.teaching.offline_learning import learn_files

Case = dict[str, Any]

GOES_ON = True
_PATIENCE_S = 30.0
_PATIENTLY = "--connect-timeout-s=100"
SITES, FILES = ("up", "demo", "remote", "local", "link"), ("learn", "rollout", "import")
MOMENTS_S = tuple(0.05 * 1.32**n for n in range(20))
"""Times of Ctrl-C, from the first imports until everything is ready [s]."""


def cases(trials: int | None, seed: int) -> list[Case]:
    """Return every command in every surrounding; with `trials`, a random choice of as many."""
    everywhere = [
        {"command": command, "where": where}
        for where, surrounding in SURROUNDINGS.items()
        for command in surrounding.commands or SITES + FILES
    ]
    twice = [{"command": command, "where": "two at once"} for command in SITES + FILES]
    interrupted = [
        {"command": each, "where": "Ctrl-C", "at_s": s} for each in SITES + FILES for s in MOMENTS_S
    ]
    found = everywhere + twice + interrupted
    if trials is None:
        return found
    chosen = np.random.default_rng(seed).choice(len(found), min(trials, len(found)), replace=False)
    return [found[number] for number in sorted(chosen)]


def trial(case: Case) -> Case:
    """Start a command, and judge the outcome."""
    began_s = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="farhand-é-") as name:
        folder = Path(name)
        _furnish(folder, case["command"])
        surrounding = SURROUNDINGS.get(case["where"], Surrounding())
        if surrounding.root and os.geteuid() != 0:
            return {**case, "verdict": "skipped", "why": "needs root"}
        outcome = _of_page(case, folder) if surrounding.commands else _of(case, surrounding, folder)
    return {**case, **outcome._asdict(), "took_s": time.monotonic() - began_s}


def _of(case: Case, surrounding: Surrounding, folder: Path) -> ProcessOutcome:
    """Start a command once, or twice at once, and interrupt it if the case says so."""
    command, serves = case["command"], case["command"] in SITES
    with ExitStack() as closing:
        arguments = _arguments(command, folder)
        if case["where"] == "two at once":
            if command == "local":
                arguments += [f"--connect={closing.enter_context(_robot(folder))}", _PATIENTLY]
            first = closing.enter_context(started(arguments, serves, surrounding, folder))
            if serves:
                first.await_ready()
        outcome = closing.enter_context(started(arguments, serves, surrounding, folder)).outcome(
            case.get("at_s")
        )
    made = command in SITES or "at_s" in case or any((folder / "out").rglob("*.*"))
    if outcome.verdict == "works" and not made:
        return ProcessOutcome("fault", "it says nothing, and has made nothing")
    return outcome


def _of_page(case: Case, folder: Path) -> ProcessOutcome:
    """Open the page of a command through a proxy that rewrites the name under which it was asked for."""
    page_port, command, named = free_port(), case["command"], case["where"] == NAMED
    with ExitStack() as closing:
        proxy_port = closing.enter_context(reverse_proxy(page_port))
        address = f"http://console.example:{proxy_port}"
        arguments = [*_arguments(command, folder), f"--port={page_port}"]
        if command == "local":
            config = folder / "local.toml"
            config.write_text(f"page_names = {json.dumps([address] if named else [])}\n", encoding="utf-8")
            arguments += [
                f"--config={config}",
                f"--connect={closing.enter_context(_robot(folder))}",
                _PATIENTLY,
            ]
        site = closing.enter_context(started(arguments, True, Surrounding(), folder))
        site.await_ready()
        if not site.is_ready:
            return ProcessOutcome("fault", f"no page: {site.outcome(None).why}")
        refusal = visit(site.facts["page"] if named else address, proxy_port)
        if named:
            return ProcessOutcome("fault", refusal) if refusal else site.outcome(None)
        if not refusal or not site.says("page_names", _PATIENCE_S):
            return ProcessOutcome("fault", f"who is not named comes in, or is not told why: {refusal}")
        ended = site.outcome(None)
        return ProcessOutcome("refused", "the page names page_names") if ended.verdict == "works" else ended


@contextmanager
def _robot(folder: Path) -> Iterator[str]:
    """Run a robot for a local site, and return its endpoint."""
    endpoint = f"tcp/{HOST}:{free_port()}"
    robot = ReadyProcess("remote", "--task=planar", f"--listen={endpoint}", f"--data-dir={folder / 'robot'}")
    try:
        yield endpoint
    finally:
        robot.kill()


def _furnish(folder: Path, command: str) -> None:
    """Add the files that commands need, and folders with packages and files that have our names."""
    steps = np.linspace(0.0, 1.0, 60)
    strokes = [[60.0 * (1.0 - steps), 40.0 * n * steps * (1.0 - steps)] for n in (1, 2)]
    np.savez(folder / "strokes.npz", pos=np.moveaxis(np.array(strokes), 1, 2), t=np.tile(2.0 * steps, (2, 1)))
    for place in ("foreign", "named"):
        for package in ("farhand", "farhand/common", "farhand/deploy"):
            (folder / place / package).mkdir(parents=True)
            (folder / place / package / "__init__.py").write_text(
                "raise SystemExit('foreign')\n", encoding="utf-8"
            )
    for file in ("queue", "random", "socket", "types", "numpy"):
        (folder / "foreign" / f"{file}.py").write_text("raise SystemExit('foreign')\n", encoding="utf-8")
    for place in ("home", "out", "scratch"):
        (folder / place).mkdir()
    demonstration = folder / "demonstration.npz"
    shutil.copy(sample_files("hot-stab")[0], demonstration)
    if command == "rollout":
        (folder / "taught.model").write_bytes(_taught(sample_files("hot-stab")[0]))


@cache
def _taught(demonstration: Path) -> bytes:
    return encode(learn_files([demonstration]))


def _arguments(command: str, folder: Path) -> list[str]:
    """Return the arguments of a command; it writes into the trial's folder wherever it lets one choose."""
    demonstration, out = str(folder / "demonstration.npz"), folder / "out"
    return {
        "up": ["up", "--task=planar", "--port=0", "--link=lan"],
        "demo": ["demo", "--task=planar", "--link=lan", f"--json={out / 'result.json'}"],
        "remote": ["remote", "--task=planar", f"--listen=tcp/{HOST}:{free_port()}"],
        "local": ["local", "--task=planar", f"--connect=tcp/{HOST}:{free_port()}", f"--port={free_port()}",
                  "--connect-timeout-s=1"],
        "link": ["link", f"--listen={HOST}:0", f"--control={HOST}:0"],
        "learn": ["learn", demonstration, "--out", str(out / "learned.model")],
        "rollout": ["rollout", str(folder / "taught.model"), "--like", demonstration, "--out", str(out / "motion.npz")],
        "import": ["import", str(folder / "strokes.npz"), "--kind=lasa", "--out", str(out / "imported")],
    }[command]  # fmt: skip


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Count the verdicts by command, and list every printed line and every fault."""
    verdicts = Counter(result["verdict"] for result in results)
    names = ("works", "refused", "interpreter", "skipped", "fault")
    rows = [
        (command, *(sum(r["command"] == command and r["verdict"] == name for r in results) for name in names))
        for command in (*SITES, *FILES)
    ]
    lines = ["# Surroundings", "", _TEXT, "", table(("command", *names), rows), ""]
    for name in ("fault", "refused"):
        lines += [f"## {name}", ""]
        lines += [
            f"- {r['command']}, {r['where']}{_moment(r)}: {r['why']}" for r in results if r["verdict"] == name
        ] + [""]
    return {"starts": len(results), **verdicts, "passed": not verdicts["fault"]}, "\n".join(lines)


def _moment(result: Case) -> str:
    return f" at {result['at_s']:.2f} s" if "at_s" in result else ""


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()
