"""Small files that once made the product fail, each for a kind: learned, imported, or refused in one line by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from farhand.common.errors import InvalidDemonstration
from farhand.local_site.recordings.importing import understand, write_all
from farhand.local_site.recordings.options import ImportOptions
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import learn_files

CASES = Path(__file__).parents[3].parent / "shared" / "cases"
pytestmark = pytest.mark.skipif(not CASES.is_dir(), reason=f"no {CASES}")


def learned(file: Path, _out: Path) -> None:
    assert learn_files([file]).n_demonstrations == 1


def refused(expected: str) -> Callable[[Path, Path], None]:
    def check(file: Path, _out: Path) -> None:
        with pytest.raises(InvalidDemonstration, match=expected) as caught:
            learn_files([CASES / "good2.npz", file])
        assert str(file) in str(caught.value) and "\n" not in str(caught.value)

    return check


def imported(file: Path, out: Path) -> None:
    (made,) = write_all([file], [understand(file, ImportOptions(kind="lasa"))], out)
    assert learn_files([made]).n_demonstrations == 1


def not_imported(file: Path, out: Path) -> None:
    with pytest.raises(InvalidDemonstration, match="damaged") as caught:
        understand(file, ImportOptions(kind="lasa"))
    assert str(file) in str(caught.value) and not out.exists()


def imported_whole(file: Path, out: Path) -> None:
    """As a spreadsheet writes it: two samples, which are too few to be learned and enough to be read."""
    (path,) = write_all([file], [understand(file, ImportOptions())], out)
    made = Demonstration.load(path)
    np.testing.assert_array_equal(made.time_s, [0.0, 0.01])
    np.testing.assert_array_equal(made.position_m, [[0.6, 0.3], [0.59, 0.31]])


WHAT_MUST_COME = {
    "good2.npz": learned,
    "no_schema.npz": learned,
    "one_point.npz": refused("position_m: a motion of at least .* got 0 mm"),
    "ms_time.npz": refused(r"time_s: .* looks like milliseconds \(0.01 s\)"),
    "mm2.npz": refused(r"position_m: .* looks like millimetres \(0.6 m\)"),
    "encrypted.npz": refused("encrypted"),
    "mirrorp.npz": refused("frame_rotation: .* mirror"),
    "gap30.npz": refused("time_s: no gap .* nothing was recorded for 30.* s after sample"),
    "lasa1.mat": imported,
    "LASA_UP.MAT": imported,
    "malformed.mat": not_imported,
    "crlf.csv": imported_whole,
}


@pytest.mark.parametrize("name", WHAT_MUST_COME)
def test_each_file_does_what_it_must(name: str, tmp_path: Path):
    WHAT_MUST_COME[name](CASES / name, tmp_path / "out")


def test_no_file_is_forgotten():
    files = {file.name for file in CASES.iterdir() if file.suffix.lower() in (".npz", ".mat", ".csv")}
    assert files == set(WHAT_MUST_COME)
