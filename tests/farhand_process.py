"""Commands of `farhand` as a user gives them, each run to its end or until the end of a block."""

from __future__ import annotations

import os
import select
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from farhand.evaluation.harness.farhand_process import FARHAND, PATIENCE_S, HeardProcess


def put_foreign_code(folder: Path) -> None:
    """Give a folder packages of our names, and files of names that we import, that end who runs them."""
    for name in ("farhand", "farhand/deploy", "farhand/common", "deploy", "common", "evaluation"):
        (folder / name).mkdir()
        for file in ("__init__.py", "cli.py", "entry.py"):
            (folder / name / file).write_text("raise SystemExit('foreign code')\n")
    for name in ("queue", "random", "signal", "socket", "types", "json", "numpy", "tyro"):
        (folder / f"{name}.py").write_text("raise SystemExit('foreign code')\n")


def farhand(
    *arguments: object, timeout_s: float = PATIENCE_S, cwd: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    words = [*FARHAND, *map(str, arguments)]
    return subprocess.run(
        words,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
        cwd=cwd,
    )


def refusal(*arguments: object) -> str:
    """What a command says that must fail: one line on standard error, and nothing else."""
    done = farhand(*arguments)
    assert done.returncode > 0, done
    lines = [line for line in done.stderr.splitlines() if " INFO " not in line]
    assert len(lines) == 1 and lines[0].startswith("farhand: "), done.stderr
    return lines[0]


@contextmanager
def running(
    *arguments: object, environment: Mapping[str, str] | None = None, command: Sequence[str] = FARHAND
) -> Iterator[HeardProcess]:
    """A process that is ended with the block, by force if need be."""
    process = HeardProcess(*arguments, environment=environment, command=command)
    try:
        yield process
    finally:
        process.kill()


def await_end(*pids: int) -> None:
    """Wait until processes that are not our children have ended."""
    for pid in pids:
        try:
            fd = os.pidfd_open(pid)
        except ProcessLookupError:
            continue
        try:
            assert select.select([fd], [], [], PATIENCE_S)[0], f"process {pid} still runs"
        finally:
            os.close(fd)
