"""What may arrive instead of a message."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgpack
import msgspec
import numpy as np

from farhand.common.wire.codec import MAX_BYTES, encode
from farhand.common.wire.messages import ANY_VERSION, SCHEMA, Message
from tests.messages import floats_in, plain

_FOREIGN = (None, 5, "text", [1, 2], {}, {1: 2}, {"schema": SCHEMA, "colour": "red"})


def malformed(message: Message) -> Iterator[bytes]:
    """Bytes that are nearly the message, or nothing like it."""
    good = encode(message)
    yield from (good[: len(good) // 2], good[:-1], good + good)
    yield b""
    yield b"\x89PNG\r\n\x1a\n" + bytes(64)
    yield b'{"schema": 1}'
    yield b"\x91" * 5000  # a list in a list in a list
    yield np.random.default_rng(0).bytes(500)
    yield bytes(MAX_BYTES + 1)
    for content in (*_FOREIGN, *_nearly(message)):
        yield msgpack.packb(content) or b""


def _nearly(message: Message) -> Iterator[dict[str, Any]]:
    """The message's fields with one thing wrong."""
    fields = plain(message)
    yield {**fields, "colour": "red"}
    other = () if isinstance(message, ANY_VERSION) else (SCHEMA + 1,)
    yield from ({**fields, "schema": schema} for schema in (0, *other, "1", None))
    for described in msgspec.structs.fields(type(message)):
        name = described.name
        yield {**fields, name: [["text"]]}
        if described.required:
            yield {key: value for key, value in fields.items() if key != name}
        if name == "position_m":
            yield from ({**fields, name: [0.1] * n} for n in (0, 1, 4))
    for _, path in floats_in(fields):
        yield from (_replaced(fields, path, number) for number in (np.nan, np.inf, -np.inf))


def _replaced(fields: dict[str, Any], path: list[str | int], number: float) -> dict[str, Any]:
    changed = msgpack.unpackb(msgpack.packb(fields) or b"")  # a copy, with lists for tuples
    inner = changed
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = float(number)
    return changed
