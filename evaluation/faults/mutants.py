"""Mutants of what is sound: bytes, trees of plain values, arrays. Each is a function of a random generator."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from io import BytesIO
from typing import Any

import msgpack
import numpy as np
from numpy.typing import NDArray

Random = np.random.Generator
Mutate = Callable[[Random, bytes], bytes]

TOKENS = (
    b"", b"\xff", b"\x00", b"nan", b"inf", b"-1", b"0", b"1e999", b"1e-320", b"9223372036854775808", b"[", b"]",
    b"{", b'"', b"\xef\xbb\xbf", b"\xed\xa0\x80", b"\n", b"\r\n", b"null", b"true", b"\x93NUMPY", b"PK\x01\x02",
)  # fmt: skip
STRANGE: tuple[Any, ...] = (
    None, True, False, -1, 0, 1, 2**31, 2**63 - 1, -(2**63), 1e308, -1e308, 1e-320, math.nan, math.inf, -math.inf,
    "", "x" * 300, "\x00", "../../evil", "a\nb", "\u202e", "nan", [], {}, [[[[[]]]]], [None], {"": 0}, b"", b"\xff",
)  # fmt: skip
_FACTORS = (-1.0, 0.0, 1e-9, 1e-3, 1e3, 1e6, 1e9, 1e160, 1e300, math.nan, math.inf)


def bytes_mutant(random: Random, data: bytes) -> bytes:
    """Return the data with one to three places changed: flipped, overwritten, removed, repeated, put in, cut off."""
    for _ in range(int(random.integers(1, 4))):
        at, n = int(random.integers(0, len(data) + 1)), int(2 ** random.uniform(0, 8))
        match int(random.integers(0, 6)):
            case 0 if at < len(data):
                data = data[:at] + bytes([data[at] ^ (1 << int(random.integers(0, 8)))]) + data[at + 1 :]
            case 1:
                data = data[:at] + random.bytes(n) + data[at + n :]
            case 2:
                data = data[:at] + data[at + n :]
            case 3:
                data = data[: at + n] + data[at:]
            case 4:
                data = data[:at] + TOKENS[int(random.integers(0, len(TOKENS)))] + data[at:]
            case _:
                data = data[:at]
    return data


def tree_mutant(random: Random, tree: Any) -> Any:
    """Return a copy of a tree of plain values in which one place is another value, gone, or there twice."""
    where = list(_places(tree))
    path = where[int(random.integers(0, len(where)))]
    return _replaced(random, tree, path)


def _places(tree: Any, path: tuple[Any, ...] = ()):
    yield path
    items = (
        tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list | tuple) else ()
    )
    for key, value in items:
        yield from _places(value, (*path, key))


def _replaced(random: Random, tree: Any, path: tuple[Any, ...]) -> Any:
    if not path:
        return _other(random, tree)
    key, rest = path[0], path[1:]
    copy = dict(tree) if isinstance(tree, dict) else list(tree)
    if not rest and random.random() < 0.2:
        if isinstance(copy, dict):
            moved = copy.pop(key)
            if random.random() < 0.5:
                copy[f"{key}_"] = moved
        else:
            copy[key : key + 1] = [copy[key]] * int(random.integers(0, 3))
        return copy
    copy[key] = _replaced(random, copy[key], rest)
    return copy


def _other(random: Random, value: Any) -> Any:
    """Another value: of the same kind, or a strange one."""
    if isinstance(value, bytes) and random.random() < 0.8:
        return _numbers_mutant(random, value) if random.random() < 0.5 else bytes_mutant(random, value)
    if isinstance(value, bool) or not isinstance(value, int | float | str) or random.random() < 0.4:
        return STRANGE[int(random.integers(0, len(STRANGE)))]
    if isinstance(value, str):
        return bytes_mutant(random, value.encode()).decode(errors="replace")
    factor = _FACTORS[int(random.integers(0, len(_FACTORS)))]
    if isinstance(value, int):
        return value + int(random.integers(-3, 1000)) if random.random() < 0.5 else -value
    return value * factor if random.random() < 0.5 else value + float(random.normal())


def _numbers_mutant(random: Random, data: bytes) -> bytes:
    """Bytes of single-precision numbers with some of them changed."""
    numbers = np.frombuffer(data[: len(data) // 4 * 4], "<f4").copy()
    if numbers.size:
        with np.errstate(all="ignore"):
            numbers[random.integers(0, numbers.size, 2)] *= np.float32(_factor(random))
    return numbers.tobytes() + data[len(data) // 4 * 4 :]


def _factor(random: Random) -> float:
    return _FACTORS[int(random.integers(0, len(_FACTORS)))]


def packed_mutant(random: Random, data: bytes) -> bytes:
    """Return MessagePack with one value changed; or with changed bytes."""
    return _coded_mutant(random, data, msgpack.unpackb, msgpack.packb)


def json_mutant(random: Random, data: bytes) -> bytes:
    """Return JSON with one value changed; or with changed bytes."""
    return _coded_mutant(random, data, json.loads, lambda tree: json.dumps(tree).encode())


def _coded_mutant(
    random: Random, data: bytes, decode: Callable[[bytes], Any], encode: Callable[[Any], Any]
) -> bytes:
    if random.random() < 0.4:
        return bytes_mutant(random, data)
    try:
        return encode(tree_mutant(random, decode(data))) or b""
    except (TypeError, ValueError, OverflowError):  # what the code does not have
        return bytes_mutant(random, data)


def lines_mutant(random: Random, data: bytes) -> bytes:
    """Return lines of JSON of which one is a mutant."""
    lines = data.splitlines() or [b"{}"]
    at = int(random.integers(0, len(lines)))
    lines[at] = json_mutant(random, lines[at])
    return b"\n".join(lines)


def array_mutant(random: Random, array: NDArray) -> NDArray:
    """Return an array with other numbers, another shape or another type."""
    with np.errstate(all="ignore"):
        match int(random.integers(0, 8)):
            case 0 if array.dtype.kind == "f":
                return array * _factor(random)
            case 1 if array.dtype.kind == "f" and array.size:
                changed = array.copy()
                changed.flat[int(random.integers(0, array.size))] *= _factor(random)
                return changed
            case 2 if array.ndim:
                return array[:: int(random.integers(-2, 0))]
            case 3 if array.ndim:
                return np.concatenate([array, array])[: int(random.integers(0, 2 * len(array) + 1))]
            case 4:
                kinds = ("<f4", "<f2", ">f8", "<i8", "|b1", "<c16", "<U3", "|S4", "|u1")
                return array.astype(str if array.dtype.kind == "U" else kinds[int(random.integers(0, 9))])
            case 5 if array.ndim:
                return array.reshape(-1) if random.random() < 0.5 else array[..., None]
            case 6 if array.dtype.kind == "f" and array.ndim:
                return array + random.normal(size=array.shape) * 10.0 ** random.uniform(-9, 3)
            case _:
                return np.broadcast_to(array.flat[0], array.shape).copy() if array.size else array


def archive_mutant(random: Random, data: bytes) -> bytes:
    """Return a `.npz` file with one array changed, gone, or under another name; or with changed bytes."""
    if random.random() < 0.4:
        return bytes_mutant(random, data)
    with np.load(BytesIO(data)) as archive:
        arrays = dict(archive)
    name = sorted(arrays)[int(random.integers(0, len(arrays)))]
    match int(random.integers(0, 10)):
        case 0:
            arrays.pop(name)
        case 1:
            arrays[f"{name}_"] = arrays.pop(name)
        case _:
            arrays[name] = array_mutant(random, arrays[name])
    out = BytesIO()
    (np.savez if random.random() < 0.5 else np.savez_compressed)(out, **arrays)
    # Only here are the headers plain text, so that they can lie.
    return _lying(random, out.getvalue()) if random.random() < 0.2 else out.getvalue()


def _lying(random: Random, data: bytes) -> bytes:
    lies = ((b"'shape': (", b"'shape': (9"), (b"'<f8'", b"'<f4'"), (b"'<f8'", b"'|O8'"), (b"False", b"True "))
    was, becomes = lies[int(random.integers(0, len(lies)))]
    return data.replace(was, becomes, 1)


def text_mutant(random: Random, data: bytes) -> bytes:
    """Return a text with one of its words another value, or one of its lines gone or repeated; or with changed bytes."""
    lines = data.split(b"\n")
    at = int(random.integers(0, len(lines)))
    match int(random.integers(0, 4)):
        case 0:
            return bytes_mutant(random, data)
        case 1:
            return b"\n".join(lines[:at] + [lines[at]] * int(random.integers(0, 3)) + lines[at + 1 :])
        case _:
            name, equals, _ = lines[at].partition(b"=")
            value = _as_toml(random)
            lines[at] = name + equals + b" " + value if equals else value
            return b"\n".join(lines)


def _as_toml(random: Random) -> bytes:
    values = (
        "-1", "0", "1e308", "nan", "inf", "-inf", "9223372036854775807", "true", '""', '"x"', "[]", "[[]]", "{}",
        "[1.0, 2.0]", "[0.0, 0.0, 0.0]", '"../../evil"', '"a\\nb"', '"\\u0000"', "1979-05-27", "[" * 900, '"' + "x" * 300 + '"',
        "1e-320", "0.5", "3", '"planar"', '"hot-stab"',
    )  # fmt: skip
    return values[int(random.integers(0, len(values)))].encode()
