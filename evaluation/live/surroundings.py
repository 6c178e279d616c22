"""Commands started in unusual surroundings: each works, or says in one line what would help.

Each trial starts a real process: `up`, `demo`, `local`, `remote`, `link`, `learn`, `rollout` or `import`, in one of
the surroundings (users, disks, folders, descriptors, terminals, networks; two at once; Ctrl-C at twenty moments of
the start). What starts a site is awaited until it is ready and then ended by Ctrl-C; what works on files must write
what it writes elsewhere. Otherwise it must end with one line that begins with `farhand: `, and with a status that is
not success. A traceback, a second line, or silence for three minutes is a fault.

Trials that only root can arrange are skipped for others, and counted.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from farhand.common.model.model_file import save
from farhand.deploy.places import sample_files
from farhand.evaluation.harness.real_process import HOST, free_port
from farhand.evaluation.harness.started import started
from farhand.evaluation.harness.surrounding import SURROUNDINGS, Surrounding
from farhand.evaluation.metrics.tables import table
from farhand.local_site.teaching.offline_learning import learn_files

Case = dict[str, Any]

SITES, FILES = ("up", "demo", "remote", "local", "link"), ("learn", "rollout", "import")
MOMENTS_S = tuple(0.05 * 1.32**n for n in range(20))
"""Times of Ctrl-C, from the first imports until everything is ready [s]."""


def cases(trials: int | None, seed: int) -> list[Case]:
    """Return every command in every surrounding; with `trials`, a random choice of as many."""
    everywhere = [{"command": command, "where": where} for where in SURROUNDINGS for command in SITES + FILES]
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
        _furnish(folder)
        surrounding = SURROUNDINGS.get(case["where"], Surrounding())
        if surrounding.root and os.geteuid() != 0:
            return {**case, "verdict": "skipped", "why": "needs root"}
        with ExitStack() as closing:
            serves = case["command"] in SITES
            arguments = _arguments(case["command"], folder)
            if case["where"] == "two at once":
                closing.enter_context(started(arguments, serves, surrounding, folder)).await_ready()
            outcome = closing.enter_context(started(arguments, serves, surrounding, folder)).outcome(
                case.get("at_s")
            )
    return {**case, **outcome._asdict(), "took_s": time.monotonic() - began_s}


def _furnish(folder: Path) -> None:
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
    demonstration = folder / "demonstration.npz"
    shutil.copy(sample_files("hot-stab")[0], demonstration)
    save(learn_files([demonstration]), folder / "taught.model")


def _arguments(command: str, folder: Path) -> list[str]:
    """Return the arguments of a command; it writes into the trial's folder wherever it lets one choose."""
    demonstration = str(folder / "demonstration.npz")
    return {
        "up": ["up", "--task=planar", "--port=0", "--link=lan"],
        "demo": ["demo", "--task=planar", "--link=lan", f"--json={folder / 'result.json'}"],
        "remote": ["remote", "--task=planar", f"--listen=tcp/{HOST}:{free_port()}"],
        "local": ["local", "--task=planar", f"--connect=tcp/{HOST}:{free_port()}", f"--port={free_port()}",
                  "--connect-timeout-s=1"],
        "link": ["link", f"--listen={HOST}:0", f"--control={HOST}:0"],
        "learn": ["learn", demonstration, "--out", str(folder / "learned.model")],
        "rollout": ["rollout", str(folder / "taught.model"), "--like", demonstration, "--out", str(folder / "motion.npz")],
        "import": ["import", "lasa", str(folder / "strokes.npz"), "--out", str(folder / "imported")],
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
