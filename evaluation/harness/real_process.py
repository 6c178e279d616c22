"""One `farhand` process, started from here."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import time
from typing import Any

from farhand.common.errors import ProcessFailed
from farhand.deploy.child import PARENT_PID, READY_FD
from farhand.deploy.entry import own_command

HOST = "127.0.0.1"


class Process:
    """One `farhand` process.

    Args:
        arguments: Of the command line.

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
        with os.fdopen(read_fd) as pipe:
            said = pipe.read()
        if not said:
            raise ProcessFailed(f"farhand {' '.join(arguments)} ended with status {self._process.wait()}")
        self.ready: dict[str, Any] = json.loads(said)
        """What it said when it was ready."""
        self.ready_s = time.monotonic()
        """When that was [s]."""

    def wait(self, timeout_s: float) -> int | None:
        """Its exit status when it has ended by itself; None when it has not in time [s]."""
        try:
            return self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return None

    def end(self) -> None:
        """Have it end as on a signal of the system."""
        self._process.terminate()
        self._process.wait()

    def kill(self) -> None:
        """End it at once, as a crash does."""
        self._process.kill()
        self._process.wait()


def free_port() -> int:
    """A port that nobody uses now."""
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        return probe.getsockname()[1]
