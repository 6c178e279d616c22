"""A TP-HSMM as bytes: MessagePack, versioned, identified by its SHA-256.

The file is ``{kind, schema, frame_names, max_distance_m, n_demonstrations, arrays}``, where every array
is ``{dtype, shape, data}`` with little-endian data. The hash that both sites compare is over these bytes.
"""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
from numpy.typing import NDArray

from common.errors import InvalidModel
from common.tphsmm import ARRAY_FIELDS, TPHSMM
from common.whole_file import write_whole

KIND = "farhand/tphsmm"
SCHEMA_VERSION = 1
MAX_BYTES = 16 * 1024 * 1024

_SCALARS = {"frame_names": list, "max_distance_m": float, "n_demonstrations": int}
_KEYS = {"kind", "schema", "arrays", *_SCALARS}
_DTYPES = {np.float64: "<f8", np.bool_: "|b1", np.int64: "<i8"}


def encode(model: TPHSMM) -> bytes:
    """The model as bytes; equal models give equal bytes."""
    arrays = {name: _pack(getattr(model, name), kind) for name, (_, kind) in ARRAY_FIELDS.items()}
    content = {
        "kind": KIND,
        "schema": SCHEMA_VERSION,
        "frame_names": list(model.frame_names),
        "max_distance_m": float(model.max_distance_m),
        "n_demonstrations": int(model.n_demonstrations),
        "arrays": arrays,
    }
    return msgpack.Packer().pack(content)


def content_hash(data: bytes) -> str:
    """What identifies a model on both sites: the SHA-256 of its bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def decode(data: bytes, source: str = "model") -> TPHSMM:
    """The model that the bytes describe.

    Args:
        data: What `encode` gave.
        source: Named in errors: the file, or the sender.

    Raises:
        InvalidModel: Truncated, foreign, of another schema, with unknown or missing fields, or breaking
            an invariant of the TP-HSMM.
    """
    content = _unpacked(data, source)
    arrays = {name: _unpack(content["arrays"][name], name, kind, source) for name, kind in _kinds()}
    try:
        return TPHSMM(
            frame_names=tuple(content["frame_names"]),
            max_distance_m=content["max_distance_m"],
            n_demonstrations=content["n_demonstrations"],
            **arrays,
        )
    except InvalidModel as error:
        raise InvalidModel(source, error.field, error.expected) from None


def save(model: TPHSMM, path: Path | str) -> str:
    """Write the model, whole or not at all, and return its content hash."""
    data = encode(model)
    write_whole(path, data)
    return content_hash(data)


def load(path: Path | str) -> TPHSMM:
    """The model in a file.

    Raises:
        InvalidModel: When the file cannot be read or is not a model; the text names file and field.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise InvalidModel(str(path), "", f"a readable model file ({error.strerror})") from error
    return decode(data, str(path))


def _kinds() -> list[tuple[str, type]]:
    return [(name, kind) for name, (_, kind) in ARRAY_FIELDS.items()]


def _pack(array: NDArray, kind: type) -> dict[str, Any]:
    dtype = _DTYPES[kind]
    return {"dtype": dtype, "shape": list(array.shape), "data": array.astype(dtype).tobytes()}


def _unpacked(data: bytes, source: str) -> dict[str, Any]:
    """The outer map, its keys and plain fields checked."""
    if len(data) > MAX_BYTES:
        raise InvalidModel(source, "", f"at most {MAX_BYTES} bytes, got {len(data)}")
    try:
        content = msgpack.unpackb(data)
    except (ValueError, msgpack.UnpackException) as error:
        raise InvalidModel(
            source, "", "a whole model file; this one is truncated or of another kind"
        ) from error
    if not isinstance(content, dict) or content.get("kind") != KIND:
        raise InvalidModel(source, "kind", f"{KIND!r}; this is not a model file")
    if content.get("schema") != SCHEMA_VERSION:
        found = content.get("schema")
        raise InvalidModel(source, "schema", f"version {SCHEMA_VERSION}, got {found!r}; learn the model anew")
    _check_keys(source, "", content, _KEYS)
    for name, kind in _SCALARS.items():
        if type(content[name]) is not kind:
            raise InvalidModel(source, name, f"type {kind.__name__}, got {type(content[name]).__name__}")
    if not isinstance(content["arrays"], dict):
        raise InvalidModel(source, "arrays", "a map of arrays")
    _check_keys(source, "arrays.", content["arrays"], set(ARRAY_FIELDS))
    return content


def _check_keys(source: str, prefix: str, found: dict[Any, Any], expected: set[str]) -> None:
    for name in found.keys() - expected:
        raise InvalidModel(source, f"{prefix}{name}", "no such field in this schema")
    for name in expected - found.keys():
        raise InvalidModel(source, f"{prefix}{name}", "a field that is missing here")


def _unpack(packed: Any, name: str, kind: type, source: str) -> NDArray:
    """One array; its bytes must be exactly those that its shape asks for."""
    if not isinstance(packed, dict) or packed.keys() != {"dtype", "shape", "data"}:
        raise InvalidModel(source, name, "an array {dtype, shape, data}")
    dtype, shape, data = packed["dtype"], packed["shape"], packed["data"]
    if dtype != _DTYPES[kind]:
        raise InvalidModel(source, name, f"dtype {_DTYPES[kind]}, got {dtype!r}")
    if not isinstance(shape, list) or not all(type(n) is int and 0 <= n <= MAX_BYTES for n in shape):
        raise InvalidModel(source, name, f"a shape of whole numbers, got {shape!r}")
    size = math.prod(shape) * np.dtype(dtype).itemsize
    if not isinstance(data, bytes) or len(data) != size:
        raise InvalidModel(source, name, f"{size} bytes for shape {tuple(shape)}")
    if kind is np.bool_ and not set(data) <= {0, 1}:
        raise InvalidModel(source, name, "truth values")
    return np.frombuffer(data, dtype=dtype).reshape(shape)
