"""Conversion of public data sets to demonstration files: metres, one frame `goal` at the last point.

lasa       handwriting: `.mat` of the LASA data set, or `.npz` with pos (N, T, 2) and t (N, T) or (T,); mm
robotasks  an arm taught by hand: `.npy` (N, T, 7), x y z and quaternion w x y z; cm
letters    letters drawn with an arm: `.npy` (N, T, 2); cm
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.common.whole_file import fault_of
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.plain_arrays import matlab_structures, plain_array, plain_arrays
from farhand.local_site.teaching.plausibility import check_units

Array = NDArray[np.float64]

# The arm recordings were resampled and carry no time; the sample number serves as phase.
_ASSUMED_RATE_HZ = 60.0


def import_recordings(kind: str, file: Path | str, out_dir: Path | str) -> list[Path]:
    """Convert one foreign file.

    Args:
        kind: ``lasa``, ``robotasks`` or ``letters``.
        file: The foreign file.
        out_dir: Folder for the demonstration files; made when missing.

    Returns:
        The files written, ``STEM_01.npz`` onwards in the order of the recordings.

    Raises:
        InvalidDemonstration: When the kind or the file is not one of these; nothing was written.
    """
    demonstrations = read_recordings(kind, file)
    out_dir, stem = Path(out_dir), Path(file).stem
    out_dir.mkdir(parents=True, exist_ok=True)
    paths = [out_dir / f"{stem}_{number:02d}.npz" for number in range(1, len(demonstrations) + 1)]
    for path, demonstration in zip(paths, demonstrations, strict=True):
        demonstration.save(path)
    return paths


def read_recordings(kind: str, file: Path | str) -> list[Demonstration]:
    """Return the demonstrations in one foreign file; errors as `import_recordings`."""
    if kind not in _READERS:
        raise InvalidDemonstration(str(file), "kind", f"one of {', '.join(sorted(_READERS))}, got {kind!r}")
    path = Path(file)
    with fault_of(path, InvalidDemonstration, f"a {kind} recording"):
        recordings = _READERS[kind](path)
        count = len(recordings)
        if not count:
            raise ValueError("there is none in it")
        return [_demonstration(f"{kind} {path.name} {n + 1}/{count}", *r) for n, r in enumerate(recordings)]


def _demonstration(source: str, time: Array, position: Array, quat: Array | None) -> Demonstration:
    try:
        made = Demonstration(
            time_s=time,
            position_m=position,
            frame_origin_m=position[-1:],
            frame_rotation=np.eye(position.shape[1])[None],
            frame_names=("goal",),
            quat_wxyz=quat,
            source=source,
        )
        check_units(made)
        return made
    except InvalidDemonstration as error:
        number = source.rpartition(" ")[2]
        raise InvalidDemonstration("", f"recording {number}, {error.field}", error.expected) from None


Recording = tuple[Array, Array, "Array | None"]


def _read_lasa(path: Path) -> list[Recording]:
    if path.suffix.lower() == ".mat":
        demos = matlab_structures(path, "demos")
        return [(np.ravel(d["t"]), np.asarray(d["pos"], dtype=float).T / 1000.0, None) for d in demos]
    arrays = plain_arrays(path)
    positions = _shaped(arrays["pos"], (None, None, 2))
    times = np.broadcast_to(arrays["t"], positions.shape[:2])
    return [(t, p / 1000.0, None) for t, p in zip(times, positions, strict=True)]


def _read_robotasks(path: Path) -> list[Recording]:
    poses = _shaped(plain_array(path), (None, None, 7))
    return [(_phase(p), p[:, :3] / 100.0, p[:, 3:]) for p in poses]


def _read_letters(path: Path) -> list[Recording]:
    positions = _shaped(plain_array(path), (None, None, 2))
    return [(_phase(p), p / 100.0, None) for p in positions]


_READERS: dict[str, Callable[[Path], list[Recording]]] = {
    "lasa": _read_lasa,
    "robotasks": _read_robotasks,
    "letters": _read_letters,
}


def _phase(samples: Array) -> Array:
    return np.arange(len(samples)) / _ASSUMED_RATE_HZ


def _shaped(array: NDArray, shape: tuple[int | None, ...]) -> Array:
    if array.ndim != len(shape) or any(
        n is not None and n != m for n, m in zip(shape, array.shape, strict=True)
    ):
        raise ValueError(f"shape {shape}, got {array.shape}")
    return np.asarray(array, dtype=float)
