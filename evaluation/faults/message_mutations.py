"""Messages as no site sends them: bytes, fields and numbers of every message of the wire, changed at random."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
from msgspec import inspect

from farhand.common.model.task_frame import TaskFrame
from farhand.common.wire.codec import decode, encode, leaves
from farhand.common.wire.messages import Message, Stamp
from farhand.common.wire.motion_encoding import RecordedMotion, packed_row
from farhand.evaluation.faults.bounds import WrongResult
from farhand.evaluation.faults.mutants import Random, packed_mutant

Decode = Callable[[bytes], bool]
_TEXTS = ("ann", "planar", "rov1", "0" * 64, "", "0" * 32, "1.0", "127.0.0.1")


def kinds() -> dict[str, tuple[bytes, Decode]]:
    """Return a sound example of everything that travels, and what a site does with such bytes, by name."""
    messages = {
        f"message {kind.__name__}": (encode(_sound(kind)), _decoder(kind))
        for kind in Message.__subclasses__()
    }
    return {**messages, "recorded motion": (_recorded().content, _take_recorded)}


def attempts(name: str) -> Callable[[Random], bool]:
    """Return what gives one mutant of a kind to its decoder."""
    sound, take = kinds()[name]
    if not take(sound):
        raise WrongResult(f"a sound one is refused: {name}")
    return lambda random: take(packed_mutant(random, sound))


def _decoder(kind: type[Message]) -> Decode:
    def take(data: bytes) -> bool:
        message = decode(data, kind)
        numbers = [value for _, value in leaves(msgspec.to_builtins(message)) if isinstance(value, float)]
        if not np.isfinite(numbers).all():
            raise WrongResult("a number that is not finite")
        if decode(encode(message), kind) != message:
            with np.errstate(all="ignore"):  # telemetry travels in single precision
                if encode(decode(encode(message), kind)) != encode(message):
                    raise WrongResult("it is another message when it is sent on")
        return True

    return take


def _recorded() -> RecordedMotion:
    frame = TaskFrame.identity(3)
    rows = [
        packed_row(0.05 * k, np.array([0.01 * k, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0]), [frame]) for k in range(20)
    ]
    return RecordedMotion(
        task="hot-stab", frame_names=("receptacle",), n_dims=3, oriented=True, began=Stamp(boot="b", t_ns=1),
        rows=b"".join(rows),
    )  # fmt: skip


def _take_recorded(data: bytes) -> bool:
    samples = RecordedMotion.from_bytes(data).samples()
    if not all(np.isfinite(each).all() for each in samples):
        raise WrongResult("a number that is not finite")
    return True


def _sound(kind: type[Any]) -> Any:
    """Return a message, or a part of one, made from the types of its fields."""
    described = inspect.type_info(kind)
    assert isinstance(described, inspect.StructType)
    return kind(**{field.name: _value(field.type) for field in described.fields if field.name != "schema"})


def _value(described: inspect.Type) -> Any:  # noqa: C901 (a case per type of field)
    match described:
        case inspect.IntType(ge=low, le=high):
            return int(max(low or 0, min(3, high if high is not None else 3)))
        case inspect.FloatType(ge=low, le=high):
            return float(max(low or 0.0, min(0.5, high if high is not None else 0.5)))
        case inspect.StrType(pattern=pattern, min_length=least, max_length=most):
            fits = (text for text in _TEXTS if (least or 0) <= len(text) <= (most or 99))
            return next(text for text in fits if pattern is None or re.search(pattern, text))
        case inspect.BytesType():
            return b"\x01\x02\x03\x04"
        case inspect.BoolType():
            return True
        case inspect.NoneType():
            return None
        case inspect.EnumType(cls=kind):
            return next(iter(kind))
        case inspect.VarTupleType(item_type=item, min_length=least, max_length=most):
            return tuple(_value(item) for _ in range(max(least or 0, min(3, most or 3))))
        case inspect.TupleType(item_types=items):
            return tuple(map(_value, items))
        case inspect.UnionType(types=types):
            return _value(next(each for each in types if not isinstance(each, inspect.NoneType)))
        case inspect.StructType(cls=kind):
            return _sound(kind)
    raise AssertionError(f"no value for {described}")
