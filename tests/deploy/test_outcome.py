"""How a command ends that cannot do its work: one line, and a status that says whose fault it is."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from farhand.common.model.model_file import save
from farhand.deploy.entry import ROOT
from tests.farhand_process import refusal
from tests.strategies import learned

PATIENCE_S = 240.0


def without(package: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a command in a process from which a package is hidden: importing it fails as where it is not installed."""
    program = (
        f"import sys; sys.modules[{package!r}] = None; from farhand.deploy.entry import run; "
        f"sys.exit(run({list(arguments)!r}))"
    )
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )


def test_what_needs_a_package_that_is_not_installed_says_how_to_get_it(tmp_path: Path):
    model = tmp_path / "hook.model"
    save(learned(), model)
    for package, *arguments in (
        ("movement_primitives", "evaluate", "promp", "--trials=1", f"--out={tmp_path}"),
        ("matplotlib", "model", "show", str(model), f"--figure={tmp_path / 'model.svg'}"),
        ("rich", "evaluate", "planar", f"--out={tmp_path}"),
    ):
        done = without(package, *arguments)
        assert done.returncode == 1
        assert done.stderr.splitlines()[-1].startswith(f"farhand: {package} is not installed: pip install")
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


@pytest.mark.parametrize(("number", "status"), [("SIGINT", 130), ("SIGTERM", 143)])
@pytest.mark.parametrize(
    "made", ["ImportError('initialization failed')", "SystemError('x')", "RuntimeError()"]
)
def test_a_signal_of_which_foreign_code_makes_something_else_ends_as_a_signal(
    number: str, status: int, made: str
):
    program = f"""
import os, signal, sys
sys.path.insert(0, {ROOT!r})
from farhand.deploy.outcome import status_of
class Command:
    def run(self):
        try:
            os.kill(os.getpid(), signal.{number})
            signal.pause()
        except BaseException:
            raise {made} from None
signal.signal(signal.SIGINT, signal.SIG_DFL)
sys.exit(status_of(Command()))
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == status
    assert done.stderr == f"farhand: {'interrupted' if status == 130 else 'terminated'}\n"
