"""What nobody reads, and what cannot be written, decides nothing: real processes with real descriptors."""

from __future__ import annotations

import fcntl
import json
import os
import re
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest

from farhand.common.impairment.link_control import RelayControl
from farhand.common.model.model_file import save
from farhand.deploy.child_process import READY_FD
from farhand.deploy.entry import own_command
from farhand.deploy.standard_streams import Log
from tests.strategies import learned

PATIENCE_S = 60.0
LINK = ("link", "--listen=127.0.0.1:0", "--target=127.0.0.1:1", "--control=127.0.0.1:0", "--profile=lan")
PIPE_BYTES, MANY = 4096, 200
"""Each change of the profile is a line of the log: together more than the pipe holds."""
KINDS = ("unread", "gone", "full", "closed")


@contextmanager
def descriptor(kind: str) -> Iterator[int]:
    """Something to write to. `closed`: its number, after it was closed."""
    if kind == "full":
        fd = os.open("/dev/full", os.O_WRONLY)
        others = []
    else:
        reader, fd = os.pipe()
        fcntl.fcntl(fd, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
        others = [reader]
        if kind == "gone":
            os.close(others.pop())
    try:
        yield fd
    finally:
        for each in (fd, *others):
            os.close(each)


def without(number: int, command: list[str]) -> list[str]:
    """The command, started without a descriptor, as a shell's `2>&-` does."""
    return ["bash", "-c", f'exec "$@" {number}>&-', "bash", *command]


@pytest.mark.parametrize("kind", KINDS)
def test_a_link_whose_log_nobody_takes_goes_on(kind: str):
    """More than any pipe holds is logged, and every command is answered."""
    read_fd, write_fd = os.pipe()
    command = own_command(*LINK)
    with descriptor("gone" if kind == "closed" else kind) as log:
        process = subprocess.Popen(
            without(2, command) if kind == "closed" else command,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=log,
            env={**os.environ, READY_FD: str(write_fd)}, pass_fds=[write_fd],
        )  # fmt: skip
        os.close(write_fd)
        try:
            with os.fdopen(read_fd) as pipe:
                ready = json.loads(pipe.read())
            control = RelayControl("127.0.0.1", ready["control_port"])
            for number in range(MANY):
                control.profile(("lan", "geo")[number % 2])
            process.terminate()
            assert process.wait(PATIENCE_S) == 0
        finally:
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("model") / "hook-é.model"
    save(learned(), file)
    return file


def show(model: Path, kind: str) -> tuple[int, str]:
    """Status and standard error of `farhand model show` whose standard output is of a kind."""
    command = own_command("model", "show", str(model))
    with descriptor("gone" if kind == "closed" else kind) as output:
        done = subprocess.run(
            without(1, command) if kind == "closed" else command,
            stdout=output, stderr=subprocess.PIPE, text=True, timeout=PATIENCE_S, check=False,
        )  # fmt: skip
    return done.returncode, done.stderr


@pytest.mark.parametrize(("kind", "why"), [("full", "No space left"), ("closed", "Bad file descriptor")])
def test_a_result_that_cannot_be_written_is_said_in_one_line(model: Path, kind: str, why: str):
    status, said = show(model, kind)
    assert status == 2
    assert len(said.splitlines()) == 1
    assert said.startswith("farhand: standard output") and why in said


def test_a_reader_that_has_seen_enough_is_no_fault(model: Path):
    assert show(model, "gone") == (0, "")


def test_work_is_done_whatever_becomes_of_the_words_about_it(model: Path, tmp_path: Path):
    figure = tmp_path / "model.svg"
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            own_command("model", "show", str(model), "--figure", str(figure)), stdout=full, stderr=full,
            timeout=PATIENCE_S, check=False,
        )  # fmt: skip
    assert done.returncode == 2, "what it printed is lost"
    assert figure.stat().st_size > 0


def test_lines_that_wait_too_long_are_dropped_and_counted():
    read_fd, fd = os.pipe()
    fcntl.fcntl(fd, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
    log, line = Log(fd, was_closed=False), b"x" * 1023 + b"\n"
    for _ in range(1000):
        assert log.write(line) == len(line)
    with os.fdopen(read_fd, "rb") as reader, ThreadPoolExecutor(1) as reading:
        all_said = reading.submit(reader.read)
        log.drain(PATIENCE_S)
        log.write(b"again\n")  # there is room again: what was dropped is told before it, at the latest
        log.drain(PATIENCE_S)
        os.close(fd)
        said = all_said.result(PATIENCE_S)
    assert said.count(b"x\n") + n_dropped(said) == 1000
    assert said.count(b"x\n") == pytest.approx(256 + 4, abs=4), "so many fit into the queue and the pipe"
    assert said.endswith(b"again\n")


def n_dropped(said: bytes) -> int:
    """All lines that it says were dropped."""
    return sum(map(int, re.findall(rb"\((\d+) lines were dropped", said)))


def test_a_sign_that_the_terminal_does_not_know_is_written_as_its_escape(model: Path):
    done = subprocess.run(
        own_command("model", "show", str(model)),
        capture_output=True, timeout=PATIENCE_S, check=False, env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )  # fmt: skip
    assert done.returncode == 0 and not done.stderr
    assert b"hook-\\xe9.model" in done.stdout
