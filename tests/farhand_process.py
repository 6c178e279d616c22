"""`farhand` as a user starts it: a process of its own, over real sockets."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from farhand.deploy.entry import own_command

FARHAND = tuple(own_command())
PATIENCE_S = 240.0


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


class FarhandProcess:
    """One that runs until it is ended. What it says on standard error is kept line by line."""

    def __init__(self, *arguments: object):
        # Not the user's own folder, of which another process may be the owner.
        self._data = TemporaryDirectory(prefix="farhand-test-", ignore_cleanup_errors=True)
        self._process = subprocess.Popen(
            [*FARHAND, *map(str, arguments)], env={**os.environ, "XDG_DATA_HOME": self._data.name},
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.pid = self._process.pid
        self._lines: list[str] = []
        self._ended = False
        self._said = threading.Condition()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def words(self) -> str:
        """All that it has said so far."""
        with self._said:
            return "\n".join(self._lines)

    @property
    def running(self) -> bool:
        return self._process.poll() is None

    def until(self, text: str) -> None:
        """Wait until it says a line with this text."""
        with self._said:
            found = self._said.wait_for(lambda: self._says(text) or self._ended, PATIENCE_S)
        assert found and self._says(text), f"waited for {text!r}, got:\n{self.words}"

    def send(self, number: signal.Signals) -> None:
        self._process.send_signal(number)

    def wait(self) -> int:
        """Its exit status."""
        status = self._process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        return status

    def kill(self) -> None:
        """End it, if it runs, and wait for that."""
        self._process.kill()
        self.wait()
        self._data.cleanup()

    def children(self) -> dict[str, int]:
        """Process ids of its own children, by the name of their command."""
        listed = Path(f"/proc/{self.pid}/task/{self.pid}/children").read_text().split()
        commands = {int(pid): Path(f"/proc/{pid}/cmdline").read_text().split("\0") for pid in listed}
        return {words[len(FARHAND)]: pid for pid, words in commands.items() if FARHAND[-1] in words}

    def _says(self, text: str) -> bool:
        return any(text in line for line in self._lines)

    def _read(self) -> None:
        assert self._process.stderr is not None
        with self._process.stderr as stream:
            for line in stream:
                with self._said:
                    self._lines.append(line.rstrip())
                    self._said.notify_all()
        with self._said:
            self._ended = True
            self._said.notify_all()


@contextmanager
def running(*arguments: object) -> Iterator[FarhandProcess]:
    """A process that is ended with the block, by force if need be."""
    process = FarhandProcess(*arguments)
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
