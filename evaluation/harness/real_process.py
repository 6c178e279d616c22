"""Child process that runs `farhand`."""

from __future__ import annotations

import json
import os
import subprocess
import time
from typing import Any

from farhand.common.address import free_port as free_port
from farhand.common.errors import ProcessFailed
from farhand.deploy.child import PARENT_PID, READY_FD
from farhand.deploy.entry import own_command

HOST = "127.0.0.1"


class Process:
    """One `farhand` process.

    Args:
        arguments: Command line.

    Raises:
        ProcessFailed: It ended before it was ready.
    """

    def __init__(self, *arguments: str):
        read_fd, write_fd = os.pipe()
        try:
            self._process = subprocess.Popen(
                own_command(*arguments),
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                env={**os.environ, READY_FD: str(write_fd), PARENT_PID: str(os.getpid())}, pass_fds=[write_fd],
            )  # fmt: skip
        finally:
            os.close(write_fd)
        with os.fdopen(read_fd, encoding="utf-8") as pipe:
            said = pipe.read()
        if not said:
            raise ProcessFailed(f"farhand {' '.join(arguments)} ended with status {self._process.wait()}")
        self.ready: dict[str, Any] = json.loads(said)
        """Line that it printed when it was ready."""
        self.ready_s = time.monotonic()
        """Time of that line [s]."""

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def wait(self, timeout_s: float) -> int | None:
        """Wait for its own end; return its exit status, or None on a time-out [s]."""
        try:
            return self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return None

    def end(self) -> None:
        """End it as a signal of the system does."""
        self._process.terminate()
        self._process.wait()

    def kill(self) -> None:
        """Kill it at once, like a crash."""
        self._process.kill()
        self._process.wait()
