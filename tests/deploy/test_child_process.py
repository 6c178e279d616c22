"""Real processes of the `farhand` command, started and ended as `farhand up` does."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
from pathlib import Path

import pytest

from farhand.common.errors import ProcessFailed
from farhand.deploy.child_process import READY_FD, Child, say_ready

PATIENCE_S = 60.0
LINK = ("link", "--listen=127.0.0.1:0", "--target=127.0.0.1:1", "--control=127.0.0.1:0", "--profile=lan")

LOUD = """
import sys
sys.stderr.buffer.write(b"a line\\n" * 50_000 + b"\\xff" * 300_000 + b"\\n" + b"x" * 100_000)
sys.exit(3)
"""


def test_a_child_says_what_its_parent_needs_to_know_and_ends_when_asked():
    async def scenario() -> None:
        child = Child("link", LINK)
        facts = await child.start()
        assert facts["port"] > 0 and facts["control_port"] > 0
        await child.end()
        assert await child.wait() == 0
        await child.end()  # again: nothing to do

    asyncio.run(asyncio.wait_for(scenario(), PATIENCE_S))


def test_a_child_that_cannot_begin_is_reported_with_its_own_reason(capfd: pytest.CaptureFixture[str]):
    async def scenario() -> None:
        with pytest.raises(ProcessFailed) as caught:
            await Child("link", (*LINK[:-1], "--profile=nowhere")).start()
        assert str(caught.value).startswith("the link process: link: profile: ")
        assert "nowhere" in str(caught.value) and "\n" not in str(caught.value)

    asyncio.run(asyncio.wait_for(scenario(), PATIENCE_S))
    assert "nowhere" not in capfd.readouterr().err, "the parent says it, once"


def test_a_child_is_read_on_whatever_it_writes_and_whoever_reads_us(monkeypatch: pytest.MonkeyPatch):
    """Many lines, a line longer than any buffer, no line feed at the end, and a standard error that fails."""
    with Path("/dev/full").open("w") as full:
        monkeypatch.setattr(sys, "stderr", full)

        async def scenario() -> None:
            child = Child("link", LINK)
            monkeypatch.setattr(
                "farhand.deploy.child_process.own_command", lambda *_: [sys.executable, "-c", LOUD]
            )
            with pytest.raises(ProcessFailed, match=r"status 3; its last line: x+$"):
                await child.start()

        asyncio.run(asyncio.wait_for(scenario(), PATIENCE_S))


def test_a_child_that_is_killed_while_it_runs_is_reported_with_its_last_line():
    async def scenario() -> None:
        child = Child("link", LINK)
        await child.start()
        assert child._process is not None
        os.kill(child._process.pid, signal.SIGKILL)
        assert await child.wait() == -signal.SIGKILL
        assert "the link process was ended by signal 9" in child.exit_message()

    asyncio.run(asyncio.wait_for(scenario(), PATIENCE_S))


def test_a_child_that_was_never_started_has_nothing_to_end():
    async def scenario() -> None:
        child = Child("link", LINK)
        await child.end()
        assert "(it said nothing)" in child.exit_message()

    asyncio.run(scenario())


def test_ready_is_said_once_and_to_a_parent_alone(monkeypatch: pytest.MonkeyPatch):
    say_ready(port=1)  # no parent: nobody is told
    read_fd, write_fd = os.pipe()
    monkeypatch.setenv(READY_FD, str(write_fd))
    say_ready(port=2)
    say_ready(port=3)
    with os.fdopen(read_fd) as pipe:
        assert [json.loads(line) for line in pipe] == [{"port": 2}]
    assert READY_FD not in os.environ
