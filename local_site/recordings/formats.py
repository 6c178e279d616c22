"""The kinds of recordings and how each is read: as tables of columns, one recording or several in a file.

csv        columns of text
bag        rosbag2 (sqlite3 and MCAP storage) and MCAP: PoseStamped, TransformStamped, Odometry, TF
lerobot    the folder of a LeRobot v3.0 data set
robomimic  HDF5 of robomimic
lasa       handwriting: `.mat` of the LASA data set, or `.npz` with pos (N, T, 2) and t (N, T) or (T,); mm
robotasks  an arm taught by hand: `.npy` (N, T, 7), x y z and quaternion w x y z; cm
letters    letters drawn with an arm: `.npy` (N, T, 2); cm

Binary files of other programs are read by a process of their own (`reader_process`), because a malformed one can crash
the library that reads it.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.common.whole_file import fault_of, read_whole
from farhand.local_site.recordings.columns import Table, assign
from farhand.local_site.recordings.csv_table import read_text
from farhand.local_site.recordings.options import ImportOptions
from farhand.local_site.teaching.plain_arrays import arrays_of, plain_array, plain_arrays

Array = NDArray[np.float64]

_READER = Path(__file__).with_name("reader_process.py")
_PATIENCE_S = 180.0
# The arrays of arm recordings were resampled and carry no time; it is taken as phase.
_ASSUMED_RATE_HZ = 60.0
_SUFFIXES = {".mcap": "bag", ".db3": "bag", ".hdf5": "robomimic", ".h5": "robomimic"}
_EXPECTED = {
    "csv": "text in columns",
    "bag": "a whole rosbag2 folder, .db3 or .mcap file; `mcap recover` and `ros2 bag reindex` mend unfinished ones",
    "lerobot": "a whole LeRobot v3.0 data set: download it again if it is damaged",
    "robomimic": "a whole HDF5 file of robomimic: download it again if it is damaged",
}
_REMEDIES = {
    ".bag": "a rosbag2 folder or an MCAP file; this name is that of ROS 1: rosbags-convert (pip install rosbags) converts it",
    ".parquet": "the folder of the data set, with meta/info.json in it",
    ".mat": "--kind lasa, for a recording of the LASA data set",
    ".npz": "--kind lasa, for pos and t in mm; a demonstration file is learned as it is: farhand learn",
    ".npy": "--kind robotasks or --kind letters, for arrays in cm",
}


class ReadRecording(NamedTuple):
    """One motion as a file has it: its number in the file, and one table, or one for each body."""

    number: int
    tables: tuple[Table, ...]


def read_file(path: Path, options: ImportOptions) -> list[ReadRecording]:
    """Return the recordings in a file or folder that are wanted.

    Raises:
        InvalidDemonstration: Naming the file, when it cannot be read or is of another kind.
    """
    kind = kind_of(path) if options.kind == "auto" else options.kind
    with fault_of(path, InvalidDemonstration, _EXPECTED.get(kind, f"a {kind} recording")):
        found = _READERS[kind](path, options)
        wanted = [recording for recording in found if not options.only or recording.number in options.only]
        if missing := set(options.only) - {recording.number for recording in wanted}:
            numbers = ", ".join(str(recording.number) for recording in found[:40])
            expected = f"numbers of its recordings ({numbers or 'none'}), got {sorted(missing)}"
            raise InvalidDemonstration("", "--only", expected)
        if not wanted:
            raise ValueError("there is no recording in it")
        return wanted


def kind_of(path: Path) -> str:
    """Return the kind that the name of a file, or what is in a folder, tells.

    Raises:
        InvalidDemonstration: When it tells none, with the remedy.
    """
    if path.is_dir():
        if (path / "meta" / "info.json").is_file():
            return "lerobot"
        if (path / "metadata.yaml").is_file():
            return "bag"
        expected = "a rosbag2 (with metadata.yaml) or a LeRobot data set (with meta/info.json); name files one by one"
        raise InvalidDemonstration(str(path), "", expected)
    suffix = path.suffix.lower()
    if suffix in _REMEDIES:
        raise InvalidDemonstration(str(path), "kind", _REMEDIES[suffix])
    return _SUFFIXES.get(suffix, "csv")


def _csv(path: Path, options: ImportOptions) -> list[ReadRecording]:
    table = read_text(read_whole(path), options.delimiter)
    column = assign(table, options).time.get("episode")
    if column is None:
        return [ReadRecording(1, (table,))]
    episodes = table.numbers[:, column]
    if np.isnan(episodes).any() or (episodes != np.round(episodes)).any():
        row = int(table.rows[np.flatnonzero(~(episodes == np.round(episodes)))[0]])
        expected = f"a whole number in column {table.headers[column]!r}, which numbers the recordings"
        raise InvalidDemonstration("", f"{table.row} {row}", expected)
    return [ReadRecording(int(n), (table.part(episodes == n),)) for n in np.unique(episodes)]


def _own_process(kind: str) -> Callable[[Path, ImportOptions], list[ReadRecording]]:
    """Return the reader that gives the path of a file to a process of its own."""

    def read(path: Path, options: ImportOptions) -> list[ReadRecording]:
        path.stat()  # an error of the file's own is told as such
        only = () if kind == "bag" else map(str, options.only)
        return _tables([kind, str(path.absolute()), *only])

    return read


def _tables(arguments: list[str], content: bytes = b"") -> list[ReadRecording]:
    # -P: nothing is imported from the folder of the script or from where the user stands.
    command = [sys.executable, "-P", str(_READER), *arguments]
    try:
        reader = subprocess.run(command, input=content, capture_output=True, timeout=_PATIENCE_S, check=False)
    except subprocess.TimeoutExpired:
        raise ValueError(f"reading it took more than {_PATIENCE_S:g} s: cut it into several files") from None
    if reader.returncode < 0:
        raise ValueError("it is damaged or too large: reading it had to be ended")
    if reader.returncode:
        raise ValueError(reader.stderr.decode(errors="replace").strip().rpartition("\n")[2])
    arrays = arrays_of(reader.stdout)
    recordings: dict[int, list[Table]] = {}
    for key, about in enumerate(json.loads(str(arrays["about"]))):
        numbers = np.asarray(arrays[str(key)], dtype=float)
        rows = np.array(about.pop("rows", range(1, len(numbers) + 1)))
        number, name, headers = about.pop("recording"), about.pop("name"), tuple(about.pop("headers"))
        recordings.setdefault(number, []).append(Table(name, headers, numbers, rows, **about))
    return [ReadRecording(number, tuple(tables)) for number, tables in sorted(recordings.items())]


def _lasa(path: Path, _options: ImportOptions) -> list[ReadRecording]:
    if path.suffix.lower() == ".mat":
        return _tables(["lasa"], read_whole(path))
    arrays = plain_arrays(path)
    positions = _shaped(arrays["pos"], (None, None, 2))
    times = np.broadcast_to(arrays["t"], positions.shape[:2])
    return _numbered(("t [s]", "x [mm]", "y [mm]"), np.concatenate([times[..., None], positions], axis=2))


def _robotasks(path: Path, options: ImportOptions) -> list[ReadRecording]:
    poses = _shaped(plain_array(path), (None, None, 7))
    return _numbered(("t [s]", "x [cm]", "y [cm]", "z [cm]", "qw", "qx", "qy", "qz"), _phased(poses, options))


def _letters(path: Path, options: ImportOptions) -> list[ReadRecording]:
    positions = _shaped(plain_array(path), (None, None, 2))
    return _numbered(("t [s]", "x [cm]", "y [cm]"), _phased(positions, options))


_READERS: dict[str, Callable[[Path, ImportOptions], list[ReadRecording]]] = {
    "csv": _csv,
    "bag": _own_process("bag"),
    "lerobot": _own_process("lerobot"),
    "robomimic": _own_process("robomimic"),
    "lasa": _lasa,
    "robotasks": _robotasks,
    "letters": _letters,
}


def _numbered(headers: tuple[str, ...], arrays: Array) -> list[ReadRecording]:
    rows = np.arange(1, arrays.shape[1] + 1)
    return [
        ReadRecording(n, (Table("", headers, array, rows, "sample"),))
        for n, array in enumerate(arrays, start=1)
    ]


def _phased(samples: Array, options: ImportOptions) -> Array:
    """Put times before the samples, at the rate that is given or assumed."""
    times = np.arange(samples.shape[1]) / (options.rate_hz or _ASSUMED_RATE_HZ)
    return np.concatenate([np.broadcast_to(times[:, None], (*samples.shape[:2], 1)), samples], axis=2)


def _shaped(array: NDArray, shape: tuple[int | None, ...]) -> Array:
    if array.ndim != len(shape) or any(
        n is not None and n != m for n, m in zip(shape, array.shape, strict=True)
    ):
        raise ValueError(f"shape {shape}, got {array.shape}")
    return np.asarray(array, dtype=float)
