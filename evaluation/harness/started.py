"""One `farhand` process in a surrounding, and what became of it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from farhand.deploy.child_process import READY_FD
from farhand.deploy.entry import ROOT, own_command
from farhand.evaluation.harness.surrounding import CANNOT_ARRANGE, Surrounding, open_stream

_PATIENCE_S, _END_S = 180.0, 40.0
_NOBODY = "no robot reported"
_ENDED_BY_CTRL_C = (0, 130, 143, -signal.SIGINT, -signal.SIGTERM)
_COLOUR = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
_LEVELS = {"INFO", "WARNING"}
_INDENTED = " " * 8
"""Beginning of the second line of a long log record on a terminal."""


class ProcessOutcome(NamedTuple):
    """Outcome of a process.

    Args:
        verdict: `works`, `refused` (with one line), `fault`, `skipped` (cannot be arranged here), or `interpreter`
            (Ctrl-C came before the first line of ours).
        why: Its line, or what is wrong.
    """

    verdict: str
    why: str = ""


class Started:
    """A process of a trial.

    Args:
        process: The process.
        serves: Whether it says that it is ready, and then runs until it is ended.
        ready: Reads the pipe on which it says so.
        said: Reads its standard error; None when nobody can.
        end_signal: What ends it.
    """

    def __init__(
        self,
        process: subprocess.Popen[bytes],
        serves: bool,
        ready: int,
        said: int | None,
        end_signal: signal.Signals,
    ):
        self._process, self._serves, self._visible, self._end_signal = (
            process,
            serves,
            said is not None,
            end_signal,
        )
        self._chunks: list[bytes] = []
        self._settled, self._said = threading.Event(), threading.Condition()
        self.is_ready = False
        self.facts: dict[str, Any] = {}
        """Facts of its ready line."""
        threading.Thread(target=self._await_ready, args=(ready,), daemon=True).start()
        self._reader = threading.Thread(target=self._read, args=(said,), daemon=True)
        if said is not None:
            self._reader.start()

    def await_ready(self) -> None:
        """Wait until it is ready, or has ended."""
        self._settled.wait(_PATIENCE_S)

    def outcome(self, at_s: float | None) -> ProcessOutcome:
        """Wait until it is ready or its work is done, interrupt it if it runs, and judge it.

        Args:
            at_s: When Ctrl-C comes in place of that [s].
        """
        if at_s is not None:
            self._wait(at_s)
        elif self._serves:
            self.await_ready()
            if not self.is_ready:
                self._wait(_END_S)
        else:
            self._wait(_PATIENCE_S)
        running = self._process.poll() is None
        if running and at_s is None and not self.is_ready:
            return ProcessOutcome("fault", f"neither ready nor ended: {self._words()[-500:]}")
        if running:
            self._process.send_signal(self._end_signal)
        if (status := self._wait(_END_S)) is None:
            if "KeyboardInterrupt" in self._words():  # it came, and the interpreter that was starting went on
                return ProcessOutcome("interpreter")
            return ProcessOutcome("fault", f"does not end on a signal: {self._words()[-500:]}")
        return self._judge(status, running)

    def kill(self) -> None:
        """End it, if it runs."""
        self._process.kill()
        self._process.wait()
        if self._visible:
            self._reader.join(_END_S)

    def _judge(self, status: int, interrupted: bool) -> ProcessOutcome:
        if self._visible:
            self._reader.join(_END_S)
        words = self._words()
        if status == CANNOT_ARRANGE:
            return ProcessOutcome("skipped", "cannot be arranged here")
        if "Traceback" in words or words.strip() == "KeyboardInterrupt":
            ours = f'File "{ROOT}' in words.replace(f"{ROOT}/.venv", "")
            return ProcessOutcome("fault", words[-1000:]) if ours else ProcessOutcome("interpreter")
        lines = spoken(words)
        if interrupted:
            # A process that is about to end with a line of its own may be interrupted after that line.
            good = (
                status in _ENDED_BY_CTRL_C and all("farhand: " in line for line in lines) and len(lines) <= 1
            )
        else:
            good = status == 0 and not self._serves and not lines
        if good or (_NOBODY in words and status == 1):
            return ProcessOutcome("works")
        if status > 0 and (not self._visible or (len(lines) == 1 and "farhand: " in lines[0])):
            return ProcessOutcome("refused", "".join(lines))
        return ProcessOutcome("fault", f"status {status}: {words[-1000:]}")

    def says(self, text: str, timeout_s: float) -> bool:
        """Wait until it has said something, for some time [s]."""
        with self._said:
            return self._said.wait_for(lambda: text in self._words(), timeout_s)

    def _words(self) -> str:
        return b"".join(self._chunks).decode(errors="replace")

    def _wait(self, timeout_s: float) -> int | None:
        try:
            return self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return None

    def _await_ready(self, fd: int) -> None:
        with os.fdopen(fd, encoding="utf-8") as pipe:
            said = pipe.read()
        self.facts, self.is_ready = json.loads(said) if said else {}, bool(said)
        self._settled.set()

    def _read(self, fd: int) -> None:
        try:
            while chunk := os.read(fd, 1 << 16):
                with self._said:
                    self._chunks.append(chunk)
                    self._said.notify_all()
        except OSError:
            return  # a terminal that nobody writes to any more


def spoken(words: str) -> list[str]:
    """Return the lines of a process's standard error that are no log: a log may say what it likes."""
    lines = _COLOUR.sub("", words).splitlines()
    return [
        line for line in lines
        if line.strip() and not line.startswith(_INDENTED) and not _LEVELS & {*line.split()[:4]}
    ]  # fmt: skip


@contextmanager
def started(arguments: list[str], serves: bool, surrounding: Surrounding, folder: Path) -> Iterator[Started]:
    """Start a command in a surrounding, and end it with the block.

    Args:
        arguments: Of the command line.
        serves: Whether it says that it is ready, and then runs until it is ended.
        surrounding: Where.
        folder: Folder of the trial.
    """
    if (
        signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    ):  # as in the background of a script: it would be inherited
        signal.signal(signal.SIGINT, signal.default_int_handler)
    ends = [open_stream(kind) for kind in surrounding.streams]
    ready, write_fd = os.pipe()
    process = subprocess.Popen(
        surrounding.command(own_command(*arguments)),
        stdin=subprocess.DEVNULL, stdout=ends[0][0], stderr=ends[1][0], pass_fds=[write_fd],
        cwd=folder / surrounding.folder,
        env=surrounding.environment(folder) | {READY_FD: str(write_fd), "COLUMNS": "1000"},
    )  # fmt: skip
    for fd in (write_fd, *(fd for fd, _ in ends)):
        os.close(fd)
    readers = [reader for _, reader in ends if reader is not None]
    said = ends[1][1] if surrounding.is_heard else None
    begun = Started(process, serves, ready, said, surrounding.ended_by)
    try:
        yield begun
    finally:
        begun.kill()
        for reader in readers:
            os.close(reader)
