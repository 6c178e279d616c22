"""Where compiled functions are kept, and what happens where they cannot be: processes with real folders."""

from __future__ import annotations

import os
import subprocess
import sys
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


def use(**variables: str) -> tuple[str, list[str]]:
    """Use one kernel in a process: was it compiled or kept, and what was said."""
    environment = {
        name: value
        for name, value in os.environ.items()
        if name not in ("HOME", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
    }
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env={**environment, **variables},
        capture_output=True, text=True, timeout=PATIENCE_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip(), done.stderr.splitlines()


def test_what_was_compiled_is_kept_for_the_next_process(tmp_path: Path):
    assert use(XDG_CACHE_HOME=str(tmp_path)) == ("compiled", [])
    assert use(XDG_CACHE_HOME=str(tmp_path)) == ("kept", [])


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
def test_a_damaged_cache_costs_one_line_and_is_made_again(suffix: str, content: bytes, tmp_path: Path):
    use(XDG_CACHE_HOME=str(tmp_path))
    damaged = list(tmp_path.rglob(f"*{suffix}"))
    assert damaged
    for file in damaged:
        file.write_bytes(content)
    done, said = use(XDG_CACHE_HOME=str(tmp_path))
    assert done == "compiled" and len(said) == 1
    assert use(XDG_CACHE_HOME=str(tmp_path)) == ("kept", [])
