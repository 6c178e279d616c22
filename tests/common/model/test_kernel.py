"""Where compiled functions are kept, and what happens where they cannot be: processes with real folders."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

PROGRAM = """
import logging, os; logging.basicConfig(format="%(message)s", level=os.environ.get("LEVEL", "WARNING"))
import numpy as np
from numba.core import event
from farhand.common.model.small_matrix import invert
with event.install_recorder("numba:compile") as compiled:
    invert(np.eye(2), np.empty((2, 2)), np.empty((2, 2)))
print("compiled" if compiled.buffer else "kept")
"""
PATIENCE_S = 120.0


FULL = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
"""Files can be made but not filled, as on a full disk."""


def use(*, first: str = "", **variables: str) -> tuple[str, list[str]]:
    """Use one kernel in a process: was it compiled or kept, and what was said."""
    environment = {
        name: value
        for name, value in os.environ.items()
        if name not in ("HOME", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
    }
    done = subprocess.run(
        [sys.executable, "-c", first + PROGRAM], env={**environment, **variables},
        capture_output=True, text=True, timeout=PATIENCE_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip(), done.stderr.splitlines()


@pytest.fixture(scope="module")
def compiled_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("compiled")
    assert use(XDG_CACHE_HOME=str(folder)) == ("compiled", [])
    return folder


@pytest.fixture
def compiled(compiled_once: Path, tmp_path: Path) -> Path:
    """A folder in which what was compiled is kept, for this test alone."""
    return shutil.copytree(compiled_once, tmp_path / "kept")


def test_what_was_compiled_is_kept_for_the_next_process(compiled_once: Path):
    assert use(XDG_CACHE_HOME=str(compiled_once)) == ("kept", [])


def test_who_compiles_says_so_once_before_and_who_does_not_says_nothing(tmp_path: Path):
    done, said = use(XDG_CACHE_HOME=str(tmp_path), LEVEL="INFO")
    assert done == "compiled" and said == [
        "compiling the method, once on this machine: about 20 s, up to a minute on a busy one"
    ]
    assert use(XDG_CACHE_HOME=str(tmp_path), LEVEL="INFO") == ("kept", [])


def test_where_the_cache_cannot_be_a_temporary_one_is_used_and_said(tmp_path: Path):
    for expected in ("compiled", "kept"):
        done, said = use(XDG_CACHE_HOME="/dev/null/cache", TMPDIR=str(tmp_path))
        assert done == expected
        assert len(said) == 1 and "XDG_CACHE_HOME" in said[0] and f"{tmp_path}/farhand-" in said[0]


def test_a_temporary_folder_that_others_may_write_is_not_used(tmp_path: Path):
    folder = tmp_path / f"farhand-{os.geteuid()}"
    folder.mkdir()
    folder.chmod(0o777)
    done, said = use(XDG_CACHE_HOME="/dev/null/cache", TMPDIR=str(tmp_path))
    assert done == "compiled" and len(said) == 1 and "no folder" in said[0]
    assert not list(folder.iterdir())


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("content", [b"", b"\x80\x04garbage"])
def test_a_damaged_cache_costs_one_line_and_is_made_again(suffix: str, content: bytes, compiled: Path):
    damaged = list(compiled.rglob(f"*{suffix}"))
    assert damaged
    for file in damaged:
        file.write_bytes(content)
    done, said = use(XDG_CACHE_HOME=str(compiled))
    assert done == "compiled" and len(said) == 1
    assert use(XDG_CACHE_HOME=str(compiled)) == ("kept", [])


def test_a_full_disk_is_noticed_at_the_start_and_costs_one_line(tmp_path: Path):
    done, said = use(first=FULL, XDG_CACHE_HOME=str(tmp_path / "cache"), TMPDIR=str(tmp_path))
    assert done == "compiled" and len(said) == 1
    assert f"no folder: {tmp_path}/cache cannot be written" in said[0] and "XDG_CACHE_HOME" in said[0]


def test_a_disk_that_fills_up_later_costs_one_line_and_ends_nothing(compiled: Path):
    for file in compiled.rglob("*.nbc"):
        file.unlink()  # and something is there, so that the folder is used
    done, said = use(first=FULL, XDG_CACHE_HOME=str(compiled))
    assert done == "compiled" and len(said) == 1 and "cannot be kept" in said[0]
    assert use(XDG_CACHE_HOME=str(compiled))[0] == "compiled"
    assert use(XDG_CACHE_HOME=str(compiled)) == ("kept", [])


def test_a_cache_on_a_full_disk_that_is_complete_is_used_without_a_word(compiled: Path):
    assert use(first=FULL, XDG_CACHE_HOME=str(compiled)) == ("kept", [])


def old_folders(farhand: Path, n: int, age_s: float) -> list[Path]:
    """Folders of earlier versions, the last one used latest."""
    folders = [farhand / f"kernels-{number:012x}" for number in range(n)]
    for number, folder in enumerate(folders):
        (folder / "a file").mkdir(parents=True)
        last_used_s = time.time() - age_s - n + number
        os.utime(folder, (last_used_s, last_used_s))
    return folders


def test_of_old_folders_the_newest_stay_by_their_last_use(tmp_path: Path):
    folders = old_folders(tmp_path / "farhand", 10, 86_400.0)
    (tmp_path / "farhand" / "another file").touch()
    use(XDG_CACHE_HOME=str(tmp_path))
    left = {path.name for path in (tmp_path / "farhand").iterdir()}
    assert left > {folder.name for folder in folders[-3:]} | {"another file"} and len(left) == 3 + 1 + 1


def test_a_folder_that_was_used_a_moment_ago_is_not_deleted(tmp_path: Path):
    folders = old_folders(tmp_path / "farhand", 10, 60.0)
    use(XDG_CACHE_HOME=str(tmp_path))
    assert all((folder / "a file").is_dir() for folder in folders)


def test_each_start_counts_as_use(compiled: Path):
    (present,) = (compiled / "farhand").iterdir()
    os.utime(present, (1.0, 1.0))
    assert use(XDG_CACHE_HOME=str(compiled)) == ("kept", [])
    assert present.stat().st_mtime > time.time() - 3600.0


def test_several_processes_delete_at_once_without_a_word(tmp_path: Path):
    old_folders(tmp_path / "farhand", 60, 86_400.0)
    with ThreadPoolExecutor(4) as pool:
        for done in [pool.submit(use, XDG_CACHE_HOME=str(tmp_path)) for _ in range(4)]:
            assert done.result()[0] in ("compiled", "kept") and done.result()[1] == []
    assert len(list((tmp_path / "farhand").iterdir())) == 4


def test_a_process_whose_folder_was_deleted_makes_it_again(tmp_path: Path):
    first = "import shutil, os\nfrom farhand.common.model.kernel import kernel_folder\nfrom farhand.common.model import small_matrix\nshutil.rmtree(kernel_folder())\n"
    assert use(first=first, XDG_CACHE_HOME=str(tmp_path)) == ("compiled", [])
    assert use(XDG_CACHE_HOME=str(tmp_path)) == ("kept", [])
