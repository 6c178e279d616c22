"""`farhand` as a user starts it: a process of its own, awaited until it is ready, or heard line by line."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from farhand.common.errors import ProcessFailed
from farhand.deploy.child_process import PARENT_PID, READY_FD
from farhand.deploy.entry import own_command

HOST = "127.0.0.1"
FARHAND = tuple(own_command())
PATIENCE_S = 240.0


class FarhandProcess:
    """Process that runs a `farhand` command.

    Args:
        arguments: Command line.
        environment: Additional variables of its environment.
        stderr: Destination of its standard error, as `subprocess` names it.
        pass_fds: File descriptors that it inherits.
        command: Words that start `farhand`; those of this Python when not given.
    """

    def __init__(
        self,
        *arguments: object,
        environment: Mapping[str, str] | None = None,
        stderr: int = subprocess.DEVNULL,
        pass_fds: tuple[int, ...] = (),
        command: Sequence[str] = FARHAND,
    ):
        self._process = subprocess.Popen(
            [*command, *map(str, arguments)], env={**os.environ, **(environment or {})}, text=True, pass_fds=pass_fds,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=stderr,
        )  # fmt: skip

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """True until the process has ended."""
        return self._process.poll() is None

    def send(self, number: signal.Signals) -> None:
        """Send a signal to the process."""
        self._process.send_signal(number)

    def wait(self, timeout_s: float = PATIENCE_S) -> int | None:
        """Wait for the process to end; return its exit status, or None on a time-out [s]."""
        try:
            return self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return None

    def end(self) -> None:
        """End the process as a signal of the system does."""
        self._process.terminate()
        self._process.wait()

    def kill(self) -> None:
        """Kill the process at once, like a crash."""
        self._process.kill()
        self._process.wait()

    def children(self) -> dict[str, int]:
        """Return the process ids of its own children by the name of their command."""
        listed = Path(f"/proc/{self.pid}/task/{self.pid}/children").read_text(encoding="utf-8").split()
        commands = {
            int(pid): Path(f"/proc/{pid}/cmdline").read_text(encoding="utf-8").split("\0") for pid in listed
        }
        return {words[len(FARHAND)]: pid for pid, words in commands.items() if FARHAND[-1] in words}


class ReadyProcess(FarhandProcess):
    """Process that is ready once it is made, and ends with the process that made it.

    Args:
        arguments: Command line.

    Raises:
        ProcessFailed: When it ended before it was ready.
    """

    def __init__(self, *arguments: object):
        read_fd, write_fd = os.pipe()
        try:
            ours = {READY_FD: str(write_fd), PARENT_PID: str(os.getpid())}
            super().__init__(*arguments, environment=ours, pass_fds=(write_fd,))
        finally:
            os.close(write_fd)
        with os.fdopen(read_fd, encoding="utf-8") as pipe:
            said = pipe.read()  # the pipe ends when the process says that it is ready, or when it dies
        if not said:
            raise ProcessFailed(f"farhand {' '.join(map(str, arguments))} ended with status {self.wait()}")
        self.ready: dict[str, Any] = json.loads(said)
        """Line that it printed when it was ready."""
        self.ready_s = time.monotonic()
        """Time of that line [s]."""


class HeardProcess(FarhandProcess):
    """Process whose lines on standard error are kept; its data folder is its own.

    Args:
        arguments: Command line.
        environment: Additional variables of its environment.
        command: Words that start `farhand`; those of this Python when not given.
    """

    def __init__(
        self,
        *arguments: object,
        environment: Mapping[str, str] | None = None,
        command: Sequence[str] = FARHAND,
    ):
        # Not the user's own folder, of which another process may be the owner.
        self._data = TemporaryDirectory(prefix="farhand-", ignore_cleanup_errors=True)
        own = {**(environment or {}), "XDG_DATA_HOME": self._data.name}
        super().__init__(*arguments, environment=own, stderr=subprocess.PIPE, command=command)
        self._lines: list[str] = []
        self._ended = False
        self._said = threading.Condition()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def words(self) -> str:
        """Everything that it has said so far."""
        with self._said:
            return "\n".join(self._lines)

    def until(self, text: str) -> None:
        """Wait until it says a line with this text."""
        with self._said:
            found = self._said.wait_for(lambda: self._says(text) or self._ended, PATIENCE_S)
        assert found and self._says(text), f"waited for {text!r}, got:\n{self.words}"

    def wait(self, timeout_s: float = PATIENCE_S) -> int | None:
        """Wait for the process to end and for its last line; return its exit status, or None on a time-out [s]."""
        status = super().wait(timeout_s)
        if status is not None:
            self._reader.join(PATIENCE_S)
        return status

    def kill(self) -> None:
        """Kill the process, if it runs, and delete its data folder."""
        super().kill()
        self._reader.join(PATIENCE_S)
        self._data.cleanup()

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
