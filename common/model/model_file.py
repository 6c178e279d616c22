"""A TP-HSMM as bytes: MessagePack, versioned, identified by its SHA-256.

The file is ``{kind, schema, frame_names, max_distance_m, n_demonstrations, shape, parts}`` with the shape
K, C, T (components, coordinates, tangent numbers) and the parts as `farhand.common.model.model_parts` makes them, rounded.
The hash that both sites compare is over these bytes.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Annotated, Any

import msgpack
import msgspec
import numpy as np

from farhand.common.errors import InvalidInput, InvalidModel
from farhand.common.model import model_parts
from farhand.common.model.manifold import Manifold
from farhand.common.model.tphsmm import MAX_COMPONENTS, TPHSMM
from farhand.common.whole_file import fault_of, read_whole, write_whole

KIND = "farhand/tphsmm"
SCHEMA_VERSION = 3
MAX_BYTES = 16 * 1024 * 1024
_MAX_DIMENSION = 16
_SMALL_BYTES = 4096
_BYTES = (0xC4, 0xC5, 0xC6)
"""First bytes of MessagePack's `bin`."""
_Map = Annotated[dict[str, msgspec.Raw], msgspec.Meta(max_length=64)]

_FIELDS = {
    "frame_names": list,
    "max_distance_m": float,
    "n_demonstrations": int,
    "shape": list,
    "parts": dict,
}
_KEYS = {"kind", "schema", *_FIELDS}


def encode(model: TPHSMM) -> bytes:
    """Encode a model as bytes; equal models give equal bytes.

    Raises:
        InvalidModel: When the bytes could not be read again, such as of numbers too large for their precision.
    """
    with fault_of("model", InvalidModel, "a model that can be written"), np.errstate(all="ignore"):
        data = _packed(model)
        decode(data)
        return data


def _packed(model: TPHSMM) -> bytes:
    content = {
        "kind": KIND,
        "schema": SCHEMA_VERSION,
        "frame_names": list(model.frame_names),
        "max_distance_m": float(model.max_distance_m),
        "n_demonstrations": int(model.n_demonstrations),
        "shape": [model.n_components, model.manifold.n_coordinates, model.manifold.n_tangent],
        "parts": model_parts.pack(model),
    }
    return msgpack.Packer().pack(content)


def part_sizes(data: bytes) -> dict[str, int]:
    """Count the bytes of a model's header and of each of its parts."""
    parts = {name: len(part) for name, part in _unpacked(data, "model")["parts"].items()}
    return {"header": len(data) - sum(parts.values()), **parts}


def content_hash(data: bytes) -> str:
    """Return the identity of a model on both sites: the SHA-256 of its bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def decode(data: bytes, source: str = "model") -> TPHSMM:
    """Decode a model from bytes.

    Args:
        data: What `encode` gave.
        source: Named in errors: the file, or the sender.

    Raises:
        InvalidModel: Truncated, foreign, of another schema, with unknown or missing fields, or breaking
            an invariant of the TP-HSMM.
    """
    with fault_of(source, InvalidModel, "a model"), np.errstate(all="ignore"):
        content = _unpacked(data, source)
        n_components, space = _shape(content["shape"], source)
        n_frames = len(content["frame_names"])
        arrays, ways = model_parts.unpack(content["parts"], n_frames, n_components, space, source)
        return TPHSMM(
            frame_names=tuple(content["frame_names"]),
            max_distance_m=content["max_distance_m"],
            n_demonstrations=content["n_demonstrations"],
            **arrays,
            ways=ways,
        )


def save(model: TPHSMM, path: Path | str) -> str:
    """Write the model, whole or not at all, and return its content hash."""
    data = encode(model)
    write_whole(path, data)
    return content_hash(data)


def load(path: Path | str) -> TPHSMM:
    """Read a model from a file.

    Raises:
        InvalidModel: When the file cannot be read or is not a model; the text names file and field.
    """
    with fault_of(path, InvalidModel, "a model file"):
        return decode(read_whole(path, MAX_BYTES), str(path))


def _map(data: bytes) -> dict[str, msgspec.Raw]:
    """Unpack a map and leave its values as they are."""
    return msgspec.msgpack.decode(data, type=_Map)


def _value(raw: msgspec.Raw, source: str, field: str) -> Any:
    """Unpack a value that is bytes, small, or the map of the parts.

    Millions of values in one another would hold up every thread of the process for a second.
    """
    data = bytes(raw)
    if data[0] in _BYTES or len(data) <= _SMALL_BYTES:
        return msgpack.unpackb(data)
    if field != "parts":
        raise InvalidModel(source, field, f"at most {_SMALL_BYTES} bytes, got {len(data)}")
    return {name: _value(part, source, f"parts.{name}") for name, part in _map(data).items()}


def _unpacked(data: bytes, source: str) -> dict[str, Any]:
    """Unpack the outer map and check its keys and plain fields."""
    if len(data) > MAX_BYTES:
        raise InvalidModel(source, "", f"at most {MAX_BYTES} bytes, got {len(data)}")
    try:
        content: Any = {name: _value(raw, source, name) for name, raw in _map(data).items()}
    except InvalidModel:
        raise
    except Exception as error:
        raise InvalidModel(
            source, "", "a whole model file; this one is truncated or of another kind"
        ) from error
    if not isinstance(content, dict) or content.get("kind") != KIND:
        raise InvalidModel(source, "kind", f"{KIND!r}; this is not a model file")
    if content.get("schema") != SCHEMA_VERSION:
        found = content.get("schema")
        raise InvalidModel(source, "schema", f"version {SCHEMA_VERSION}, got {found!r}; learn the model anew")
    _check_keys(source, "", content, _KEYS)
    for name, kind in _FIELDS.items():
        if type(content[name]) is not kind:
            raise InvalidModel(source, name, f"type {kind.__name__}, got {type(content[name]).__name__}")
    _check_keys(source, "parts.", content["parts"], set(model_parts.PARTS))
    for name, part in content["parts"].items():
        if not isinstance(part, bytes):
            raise InvalidModel(source, f"parts.{name}", f"bytes, got {type(part).__name__}")
    return content


def _shape(shape: list[Any], source: str) -> tuple[int, Manifold]:
    """Number of components, and the space."""
    limits = (MAX_COMPONENTS, _MAX_DIMENSION, _MAX_DIMENSION)
    known = len(shape) == len(limits) and all(type(n) is int for n in shape)
    if not known or not all(1 <= n <= limit for n, limit in zip(shape, limits, strict=True)):
        raise InvalidModel(source, "shape", f"K, C, T from 1 to {limits}, got {shape!r}")
    try:
        return shape[0], Manifold.of(shape[1], shape[2])
    except InvalidInput as error:
        raise InvalidModel(source, "shape", error.expected) from None


def _check_keys(source: str, prefix: str, found: dict[Any, Any], expected: set[str]) -> None:
    for name in found.keys() - expected:
        raise InvalidModel(source, f"{prefix}{name}", "no such field in this schema")
    for name in expected - found.keys():
        raise InvalidModel(source, f"{prefix}{name}", "a field that is missing here")
