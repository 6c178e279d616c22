"""A folder of recordings, demonstrations and a model, for the commands that work on files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from tests.farhand_process import farhand
from tests.strategies import stroke

N_RECORDINGS = 4


def make_files(folder: Path) -> None:
    """A foreign recording `hook.npz`, its demonstrations and a model of all but the last."""
    rng = np.random.default_rng(0)
    motions = [1000.0 * stroke(rng, 2, 200) + [20.0, -30.0] for _ in range(N_RECORDINGS)]  # mm
    np.savez(folder / "hook.npz", pos=np.stack(motions), t=np.linspace(0.0, 3.0, 200))
    taught = folder / "taught"
    assert farhand("import", folder / "hook.npz", "--kind", "lasa", "--out", taught).returncode == 0
    assert farhand("learn", *demonstrations(folder)[:-1], "--out", folder / "hook.model").returncode == 0


def demonstrations(folder: Path) -> list[Path]:
    return sorted((folder / "taught").glob("hook_*.npz"))


@contextmanager
def unchanged(*folders: Path) -> Iterator[None]:
    """Nothing in these folders changes, comes or goes."""

    def content() -> dict[Path, bytes]:
        return {file: file.read_bytes() for folder in folders for file in folder.rglob("*") if file.is_file()}

    before = content()
    yield
    assert content() == before
