"""Where temporary files go, and what is said where they cannot."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from farhand.common.temporary_folder import NoTemporaryFolder, temporary_folder
from farhand.deploy.entry import ROOT
from farhand.deploy.places import site_name

_NO_FOLDER = "import tempfile; tempfile._candidate_tempdir_list = lambda: ['/nowhere']\n"
"""What a disk that is read-only everywhere does to the search for a folder."""


@pytest.fixture(autouse=True)
def searched_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # After `tmp_path`, which searches itself.
    monkeypatch.setattr(tempfile, "tempdir", None)


def test_a_folder_that_can_be_written_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    assert temporary_folder() == tmp_path


@pytest.mark.parametrize("chosen", [None, "/nowhere", "/dev/null"])
def test_no_temporary_folder_is_told_with_its_variable_and_the_remedy(
    chosen: str | None, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(tempfile, "_candidate_tempdir_list", lambda: ["/nowhere"])
    if chosen is None:
        monkeypatch.delenv("TMPDIR", raising=False)
    else:
        monkeypatch.setenv("TMPDIR", chosen)
    with pytest.raises(NoTemporaryFolder, match="set the variable TMPDIR to a folder with room") as caught:
        temporary_folder()
    assert (chosen or "no TMPDIR") in str(caught.value)


@pytest.mark.parametrize("command", [["demo", "--task=planar", "--link=lan"]])
def test_a_command_without_any_says_so_in_one_line(command: list[str], tmp_path: Path):
    start = f"{_NO_FOLDER}import sys; sys.path.insert(0, {ROOT!r})\nfrom farhand.deploy.cli import main\nsys.exit(main({command!r}))"
    done = subprocess.run(
        [sys.executable, "-c", start], capture_output=True, text=True, check=False, timeout=120,
        env={**os.environ, "XDG_DATA_HOME": str(tmp_path), "FARHAND_RUNTIME_DIR": str(tmp_path)},
    )  # fmt: skip
    lines = [line for line in done.stderr.splitlines() if " INFO " not in line]
    assert done.returncode == 1 and len(lines) == 1, done.stderr
    assert lines[0].startswith("farhand: no temporary folder can be written") and "TMPDIR" in lines[0]


def test_a_site_with_a_data_folder_needs_no_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("XDG_DATA_HOME", raising=False)

    def no_home(_: Path) -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "expanduser", lambda path: path if str(path)[:1] != "~" else no_home(path))
    assert site_name(tmp_path / "a") != site_name(tmp_path / "b")


def test_the_status_of_processes_can_be_asked_without_any(tmp_path: Path):
    start = f"{_NO_FOLDER}import sys; sys.path.insert(0, {ROOT!r})\nfrom farhand.deploy.cli import main\nsys.exit(main(['status']))"
    variables = {"XDG_RUNTIME_DIR": str(tmp_path), "PATH": os.environ["PATH"]}
    done = subprocess.run(
        [sys.executable, "-c", start], capture_output=True, text=True, check=False, timeout=120, env=variables
    )
    assert done.returncode == 4 and done.stderr == "", done.stderr
