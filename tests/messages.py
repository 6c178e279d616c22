"""Every message class of the wire, with hypothesis strategies made from its own field types."""

from __future__ import annotations

import functools
from typing import Any

import msgpack
import numpy as np
from hypothesis import strategies as st
from msgspec import inspect

from farhand.common import names
from farhand.common.wire.codec import encode
from farhand.common.wire.messages import SCHEMA, Message
from farhand.common.wire.reason_words import sentence
from farhand.common.wire.reasons import Reason


def all_kinds() -> list[type[Message]]:
    """Every class of message that there is."""
    return sorted(Message.__subclasses__(), key=lambda kind: kind.__name__)


@functools.cache
def instances(kind: type[Message]) -> st.SearchStrategy[Message]:
    """Any valid message of a class."""
    described = inspect.type_info(kind)
    assert isinstance(described, inspect.StructType)
    fields = {f.name: _values(f.type) for f in described.fields if f.name != "schema"}
    return st.fixed_dictionaries(fields).map(lambda values: kind(**values))


def said(message: Any) -> str:
    """The reason in a message, in words."""
    return sentence(message.reason, getattr(message, "cause", None))


def plain(message: Message) -> dict[str, Any]:
    """What MessagePack would hold, as plain Python."""
    return msgpack.unpackb(encode(message))


def floats_in(value: Any, path: str = "") -> list[tuple[str, list[str | int]]]:
    """Path of every number that may be a fraction, in words and as keys to follow."""
    found: list[tuple[str, list[str | int]]] = []
    if isinstance(value, float):
        found.append((path, []))
    items = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list | tuple)
        else ()
    )
    for key, inner in items:
        inner_path = f"{path}[{key}]" if isinstance(key, int) else f"{path}.{key}".lstrip(".")
        found += [(where, [key, *keys]) for where, keys in floats_in(inner, inner_path)]
    return found


def _values(described: inspect.Type) -> st.SearchStrategy[Any]:  # noqa: C901 (a case per type of field)
    match described:
        case inspect.IntType(ge=low, le=high):
            return st.integers(-(2**63) if low is None else low, 2**63 - 1 if high is None else high)
        case inspect.FloatType(ge=low, le=high, gt=above):
            least, most = _single(low if low is not None else above, np.inf), _single(high, -np.inf)
            return st.floats(least, most, width=32, exclude_min=above is not None,
                             allow_nan=False, allow_infinity=False)  # fmt: skip
        case inspect.StrType(pattern=None, max_length=longest):
            return st.text(st.characters(exclude_categories=["Cs"]), max_size=min(longest or 40, 40))
        case inspect.StrType(pattern=names.PRINTABLE, max_length=longest):
            return st.text(
                st.characters(exclude_categories=["Cs", "Cc", "Zl", "Zp"]), max_size=min(longest or 40, 40)
            )
        case inspect.StrType(pattern=names.PATTERN, max_length=longest):
            return st.from_regex(names.PATTERN, fullmatch=True).filter(
                lambda name: len(name) <= (longest or 40)
            )
        case inspect.StrType(pattern=r"^([0-9a-f]{64})?\Z"):
            return st.sampled_from(["", "0" * 64, "0123456789abcdef" * 4])
        case inspect.BytesType():
            return st.binary(max_size=64)
        case inspect.BoolType():
            return st.booleans()
        case inspect.NoneType():
            return st.none()
        case inspect.EnumType(cls=kind):
            return st.sampled_from(list(kind))
        case inspect.VarTupleType(item_type=item, min_length=least, max_length=most):
            return st.lists(_values(item), min_size=least or 0, max_size=min(most or 3, 6)).map(tuple)
        case inspect.TupleType(item_types=items):
            return st.tuples(*map(_values, items))
        case inspect.UnionType(types=types):
            return st.one_of([_values(each) for each in types])
        case inspect.StructType(cls=kind, fields=fields):
            return st.builds(kind, **{f.name: _values(f.type) for f in fields})
    raise AssertionError(f"no strategy for {described}")


def _single(bound: float | None, inwards: float) -> float | None:
    """The single-precision number that is nearest to a bound, on the side where values are allowed."""
    if bound is None:
        return None
    single = np.float32(bound)
    outside = float(single) < bound if inwards > 0 else float(single) > bound
    return float(np.nextafter(single, np.float32(inwards)) if outside else single)


reasons = _values(inspect.type_info(Reason))

__all__ = ["SCHEMA", "all_kinds", "floats_in", "instances", "plain", "reasons", "said"]
