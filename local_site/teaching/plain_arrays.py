"""Plain arrays from `.npz` and `.npy` files of unknown origin: no pickle, no trust in headers.

The size that a header claims is compared with the file's before memory is taken for it.
"""

from __future__ import annotations

import math
import re
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.common.whole_file import fault_of, read_whole

MAX_NUMBERS = 6_000_000
"""Largest count of numbers in one file, all its arrays together."""
_MAX_MEMBERS = 4096
_PLAIN = "biufcU"
_HEADER = {
    "descr": rb"['\"]descr['\"]: *['\"]([<>|=]?[a-zA-Z]\d+)['\"]",
    "fortran_order": rb"['\"]fortran_order['\"]: *(True|False)",
    "shape": rb"['\"]shape['\"]: *\(([0-9L, ]*)\)",
}


def plain_arrays(path: Path | str) -> dict[str, NDArray]:
    """Return all arrays of a `.npz` file.

    Raises:
        InvalidDemonstration: Naming the file, when it cannot be read or is of another kind.
    """
    with fault_of(path, InvalidDemonstration, "a whole .npz file of plain arrays"):
        return arrays_of(read_whole(path))


def plain_array(path: Path | str) -> NDArray:
    """Return the array of a `.npy` file; errors as `plain_arrays`."""
    with fault_of(path, InvalidDemonstration, "a whole .npy file of a plain array"):
        return _array_of(read_whole(path), MAX_NUMBERS)


def arrays_of(content: bytes) -> dict[str, NDArray]:
    """Return the arrays in the bytes of a `.npz` file; faults raise ValueError, or what zipfile raises."""
    if content.count(b"PK\x01\x02") > _MAX_MEMBERS:
        raise ValueError(f"more than {_MAX_MEMBERS} members")
    arrays: dict[str, NDArray] = {}
    with zipfile.ZipFile(BytesIO(content)) as archive:
        left = MAX_NUMBERS
        for member in archive.infolist():
            name = member.filename.removesuffix(".npy")
            if name == member.filename or name in arrays:
                raise ValueError(f"it has {member.filename!r}, which is no array or there twice")
            plain = member.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
            if not plain or member.flag_bits & 1:
                raise ValueError(f"{name} is encrypted, or compressed in an unknown way")
            with archive.open(member) as stream:
                data = stream.read(8 * left + 1024)
            arrays[name] = _array_of(data, left, name)
            left -= arrays[name].size
    return arrays


def _array_of(data: bytes, most: int, name: str = "the array") -> NDArray:
    """Return the array in the bytes of a `.npy` file; refuse more than `most` numbers."""
    if data[:6] != b"\x93NUMPY" or len(data) < 12:
        raise ValueError(f"{name} is no array of numpy's")
    start = 10 if data[6] == 1 else 12
    end = start + int.from_bytes(data[8:start], "little")
    header, body = data[start:end], memoryview(data)[end:]
    found = {key: re.search(pattern, header[:4096]) for key, pattern in _HEADER.items()}
    if not all(found.values()):
        raise ValueError(f"{name} is no array of plain numbers or text")
    descr, order, axes = (found[key][1].decode() for key in _HEADER)  # pyright: ignore[reportOptionalSubscript]
    kind, shape = np.dtype(descr), tuple(int(axis.strip(" L")) for axis in axes.split(",") if axis.strip())
    if kind.kind not in _PLAIN or kind.itemsize == 0 or len(shape) > 8 or 0 in shape:
        raise ValueError(f"{name} is no array of plain numbers or text, or empty")
    n_bytes = math.prod(shape) * kind.itemsize
    if math.prod(shape) > most or n_bytes > 8 * most:
        raise ValueError(f"{name} would hold more than the {MAX_NUMBERS} numbers that a file may have")
    if n_bytes != len(body):
        raise ValueError(f"{name} has {len(body)} bytes where its header claims {n_bytes}")
    return np.frombuffer(body, kind).reshape(shape, order="F" if order == "True" else "C")
