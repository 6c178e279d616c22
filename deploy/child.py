"""A child process of `farhand up` and `farhand demo`: started, watched, ended."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
from collections import deque
from collections.abc import Sequence
from typing import Any

from farhand.common.errors import ProcessFailed
from farhand.common.parent_process import end_with_parent

READY_FD = "FARHAND_READY_FD"
"""Names the file descriptor on which a child says that it is ready."""

PARENT_PID = "FARHAND_PARENT_PID"
"""Names the parent, so that a child sees that it has died."""

_END_PATIENCE_S = 10.0
_LAST_WORDS = 12


def say_ready(**facts: Any) -> None:
    """In a child: tell the parent, if there is one, that this process is ready.

    Args:
        facts: What the parent needs to know, such as the port that was taken.
    """
    if (fd := os.environ.pop(READY_FD, None)) is not None:
        with os.fdopen(int(fd), "w") as pipe:
            pipe.write(json.dumps(facts) + "\n")


def follow_parent() -> None:
    """In a child: be ended when the parent dies. A process of its own is no child, and goes on."""
    if (parent_pid := os.environ.pop(PARENT_PID, None)) is not None:
        end_with_parent(int(parent_pid))


class Child:
    """One process.

    Args:
        name: For messages.
        arguments: Of the `farhand` command.
    """

    def __init__(self, name: str, arguments: Sequence[str]):
        self.name = name
        self.ready = False
        """Whether it has said so."""
        self._arguments = list(arguments)
        self._last_words: deque[str] = deque(maxlen=_LAST_WORDS)
        self._process: asyncio.subprocess.Process | None = None
        self._reading: asyncio.Task[None] | None = None

    async def start(self) -> dict[str, Any]:
        """Start it and wait until it says that it is ready.

        Returns:
            What it said.

        Raises:
            ProcessFailed: When it ended instead, with its own words.
        """
        read_fd, write_fd = os.pipe()
        try:
            self._process = await asyncio.create_subprocess_exec(
                sys.executable, "-m", "farhand.deploy.cli", *self._arguments,
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
            raise ProcessFailed(self.obituary())
        self.ready = True
        return json.loads(said)

    async def wait(self) -> int:
        """Wait for its end.

        Returns:
            Its exit status.
        """
        assert self._process is not None and self._reading is not None
        status = await self._process.wait()
        await self._reading
        return status

    async def end(self) -> None:
        """End it: politely, and by force when it does not listen."""
        if self._process is None or self._process.returncode is not None:
            return
        with contextlib.suppress(ProcessLookupError):
            self._process.terminate()
        try:
            await asyncio.wait_for(self._process.wait(), _END_PATIENCE_S)
        except TimeoutError:
            self._process.kill()
        await self.wait()

    def obituary(self) -> str:
        """How it ended, with its own last words."""
        status = self._process.returncode if self._process else None
        words = "\n".join(f"    {line}" for line in self._last_words) or "    (it said nothing)"
        return f"the {self.name} process ended with status {status}; its last words:\n{words}"

    async def _pass_on(self, process: asyncio.subprocess.Process) -> None:
        assert process.stderr is not None
        async for line in process.stderr:
            text = line.decode(errors="replace").rstrip()
            self._last_words.append(text)
            sys.stderr.write(text + "\n")


def _read_all(fd: int) -> str:
    with os.fdopen(fd) as pipe:
        return pipe.read()
