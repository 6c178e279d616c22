"""Conversion of messages to bytes and back. An arriving message is checked completely before it is handled."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import Any, TypeVar

import msgpack
import msgspec

from farhand.common.errors import InvalidMessage, field_of
from farhand.common.wire.messages import ANY_VERSION, MAX_BYTES, SCHEMA, Message, Telemetry

M = TypeVar("M", bound=Message)

_MOST_SINGLE = (2.0 - 2.0**-23) * 2.0**127


def encode(message: Message) -> bytes:
    """Encode a message as MessagePack bytes. Telemetry is sent in single precision, to fit its budget."""
    plain = {
        _schema_key(type(message)): message.schema,
        **msgspec.to_builtins(message, builtin_types=(bytes,)),
    }
    packer = msgpack.Packer(use_single_float=isinstance(message, Telemetry))
    return packer.pack(plain)


def decode(data: bytes, kind: type[M]) -> M:
    """Decode a message from bytes.

    Args:
        data: Bytes that arrived.
        kind: Message type of the key on which it arrived.

    Raises:
        InvalidMessage: When the bytes are too many, are not MessagePack, have another schema, an
            unknown or missing field, a wrong type or shape, or a number that is not finite.
    """
    name = kind.__name__
    if len(data) > MAX_BYTES:
        raise InvalidMessage(name, "", f"at most {MAX_BYTES} bytes, got {len(data)}")
    try:
        plain = msgpack.unpackb(data, raw=False, strict_map_key=True)
    except Exception as error:
        raise InvalidMessage(
            name, "", f"MessagePack was expected, but it does not decode ({error})"
        ) from error
    _check_schema(plain, kind)
    try:
        message = msgspec.convert(plain, kind, builtin_types=(bytes,))
    except msgspec.ValidationError as error:
        raise InvalidMessage(name, *field_of(error)) from error
    for path, number in numbers(plain):
        if not math.isfinite(number):
            raise InvalidMessage(name, path, f"a finite number, got {number}")
        if kind is Telemetry and abs(number) > _MOST_SINGLE:
            raise InvalidMessage(name, path, f"a number of single precision, got {number:g}")
    return message


def _check_schema(plain: Any, kind: type[Message]) -> None:
    """Report clearly that the other site speaks another version, before any field is checked."""
    if not isinstance(plain, dict):
        raise InvalidMessage(kind.__name__, "", f"a map of fields, got {type(plain).__name__}")
    theirs = plain.get(_schema_key(kind))
    if theirs != SCHEMA and not (kind in ANY_VERSION and type(theirs) is int and theirs > 0):
        raise InvalidMessage(
            kind.__name__, "schema", f"version {SCHEMA}, got {theirs!r}: run the same Farhand on both sites"
        )


@cache
def _schema_key(kind: type[Message]) -> str:
    """Return the schema's name on the wire; looking it up takes longer than the rest of decoding."""
    return next(field.encode_name for field in msgspec.structs.fields(kind) if field.name == "schema")


def numbers(plain: Any) -> Iterator[tuple[str, float]]:
    """Iterate over the floating-point numbers in plain Python and the paths to them."""
    return ((path, value) for path, value in leaves(plain) if isinstance(value, float))


def leaves(plain: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Iterate over all values in plain Python that contain no others, and the path to each."""
    if isinstance(plain, dict):
        for key, value in plain.items():
            yield from leaves(value, f"{path}.{key}".lstrip("."))
    elif isinstance(plain, list | tuple):
        for index, value in enumerate(plain):
            yield from leaves(value, f"{path}[{index}]")
    else:
        yield path, plain
