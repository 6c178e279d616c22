"""Child process of `farhand up` and `farhand demo`: its start, its watch and its end."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
from collections.abc import Sequence
from typing import Any

from farhand.common.errors import ProcessFailed
from farhand.common.parent_process import end_with_parent
from farhand.deploy.entry import own_command

READY_FD = "FARHAND_READY_FD"
"""Name of the variable with the file descriptor on which a child says that it is ready."""

PARENT_PID = "FARHAND_PARENT_PID"
"""Name of the variable with the parent's id, so that a child notices its death."""

REFUSED = "farhand: "
"""Beginning of the line with the reason why a process ends."""

_END_PATIENCE_S = 10.0
_CHUNK_BYTES = 1 << 16


def say_ready(**facts: Any) -> None:
    """Tell the parent, if there is one, that this child process is ready.

    Args:
        facts: Facts that the parent needs, such as the port that was taken.
    """
    if (fd := os.environ.pop(READY_FD, None)) is not None:
        with os.fdopen(int(fd), "w", encoding="utf-8") as pipe:
            pipe.write(json.dumps(facts) + "\n")


def follow_parent() -> None:
    """End this child process when its parent dies. A process without a parent of ours continues."""
    if (parent_pid := os.environ.pop(PARENT_PID, None)) is not None:
        end_with_parent(int(parent_pid))


class Child:
    """Child process.

    Args:
        name: Name for messages.
        arguments: Arguments of the `farhand` command.
    """

    def __init__(self, name: str, arguments: Sequence[str]):
        self.name = name
        self.ready = False
        """True once the child has said that it is ready."""
        self._arguments = list(arguments)
        self.refusal = ""
        """Reason of the end in the child's own words; empty if it gave none."""
        self._last_line = ""
        self._process: asyncio.subprocess.Process | None = None
        self._reading: asyncio.Task[None] | None = None

    async def start(self) -> dict[str, Any]:
        """Start the child and wait until it says that it is ready.

        Returns:
            The facts that the child sent, such as its port.

        Raises:
            ProcessFailed: When the child ended instead; with its reason.
        """
        read_fd, write_fd = os.pipe()
        try:
            self._process = await asyncio.create_subprocess_exec(
                *own_command(*self._arguments),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.DEVNULL,
                stderr=asyncio.subprocess.PIPE,
                env={**os.environ, READY_FD: str(write_fd), PARENT_PID: str(os.getpid())},
                pass_fds=[write_fd],
                start_new_session=True,  # Ctrl-C in the terminal is the parent's to pass on, in order
            )  # fmt: skip
        finally:
            os.close(write_fd)
        self._reading = asyncio.create_task(self._pass_on(self._process))
        # The pipe ends when the child says that it is ready, or when it dies.
        said = await asyncio.to_thread(_read_all, read_fd)
        if not said:
            await self.wait()
            raise ProcessFailed(self.exit_message())
        self.ready = True
        return json.loads(said)

    async def wait(self) -> int:
        """Wait for the child's end.

        Returns:
            The exit status.
        """
        assert self._process is not None and self._reading is not None
        status = await self._process.wait()
        await self._reading
        return status

    async def end(self) -> None:
        """End the child, by force if it does not react to SIGTERM."""
        if self._process is None or self._process.returncode is not None:
            return
        with contextlib.suppress(ProcessLookupError):
            self._process.terminate()
        try:
            await asyncio.wait_for(self._process.wait(), _END_PATIENCE_S)
        except TimeoutError:
            self._process.kill()
        await self.wait()

    def exit_message(self) -> str:
        """Return one line about the child's end: its own reason, else its exit status and last line."""
        if self.refusal:
            return f"the {self.name} process: {self.refusal}"
        status = self._process.returncode if self._process else None
        how = f"was ended by signal {-status}" if status and status < 0 else f"ended with status {status}"
        return f"the {self.name} process {how}; its last line: {self._last_line or '(it said nothing)'}"

    async def _pass_on(self, process: asyncio.subprocess.Process) -> None:
        """Read the child's log to the end: a child whose log nobody reads would block."""
        assert process.stderr is not None
        rest = b""
        while chunk := await process.stderr.read(_CHUNK_BYTES):
            *lines, rest = (rest + chunk).split(b"\n")
            if len(rest) > _CHUNK_BYTES:
                lines, rest = [*lines, rest], b""
            for line in lines:
                self._say(line)
        if rest:
            self._say(rest)

    def _say(self, line: bytes) -> None:
        text = line.decode(errors="replace").rstrip()
        if text.startswith(REFUSED):
            self.refusal = text.removeprefix(REFUSED)  # the parent reports it, with the exit status
            return
        self._last_line = text or self._last_line
        with contextlib.suppress(OSError):
            sys.stderr.write(text + "\n")


def _read_all(fd: int) -> str:
    with os.fdopen(fd, encoding="utf-8") as pipe:
        return pipe.read()
