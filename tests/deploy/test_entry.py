"""Every process runs the code of the one that started it, whatever stands in the folder where it is started."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from pathlib import Path

import pytest

from farhand.deploy.child_process import Child
from farhand.deploy.entry import ROOT, own_command
from tests.farhand_process import put_foreign_code

PATIENCE_S = 240.0
LINK = ("link", "--listen=127.0.0.1:0", "--target=127.0.0.1:1", "--control=127.0.0.1:0", "--profile=lan")


@pytest.fixture
def foreign_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: every name that is ours or that we import is foreign here."""
    put_foreign_code(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("foreign_folder")
def test_a_child_runs_its_parents_code():
    async def scenario() -> None:
        child = Child("link", LINK)
        facts = await child.start()
        assert facts["port"] > 0
        await child.end()

    asyncio.run(asyncio.wait_for(scenario(), PATIENCE_S))


def test_our_package_comes_before_a_foreign_path(foreign_folder: Path):
    for file in foreign_folder.glob("*.py"):
        file.unlink()
    # As many shells have it that were set up for a robot: an empty part is the working directory.
    done = subprocess.run(
        own_command("model", "show", "none.model"), capture_output=True, text=True, timeout=PATIENCE_S,
        check=False, env={**os.environ, "PYTHONPATH": ":/nowhere"},
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith("farhand: none.model: a readable ")


@pytest.mark.usefixtures("foreign_folder")
def test_a_command_that_is_installed_runs_its_own_code():
    script = Path(sys.executable).with_name("farhand")
    done = subprocess.run(
        [script, "link", "--profile=none"], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == 2 and "none" in done.stderr and len(done.stderr.splitlines()) == 1


def test_a_process_is_run_from_the_folder_of_this_code():
    assert Path(own_command("up")[2]).is_relative_to(Path(__file__).resolve().parents[2])
    assert Path(ROOT, "farhand", "deploy", "cli.py").is_file()


def test_python_m_farhand_is_the_command_with_its_exit_status():
    done = subprocess.run(
        [sys.executable, "-m", "farhand", "link", "--profile=none"],
        capture_output=True, text=True, timeout=PATIENCE_S, check=False,
    )  # fmt: skip
    assert done.returncode == 2 and done.stderr.startswith("farhand: ")
