from __future__ import annotations

import contextlib
import math
from typing import Any

import msgpack
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import inspect, structs

from docs.protocol_page import FLOWS
from farhand.common import names
from farhand.common.errors import InvalidMessage
from farhand.common.wire.codec import MAX_BYTES, decode, encode
from farhand.common.wire.messages import (
    ANY_VERSION,
    MOST_TASKS,
    SCHEMA,
    Command,
    Event,
    EventsReply,
    EventsRequest,
    Heartbeat,
    LeaseReply,
    Message,
    ModelTransfer,
    OperatorInput,
    Stamp,
    Stop,
    StopAck,
    Telemetry,
)
from farhand.remote_site.supervision.event_log import Events
from tests.messages import all_kinds, floats_in, instances, plain

KINDS = all_kinds()
by_kind = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
quick = settings(deadline=None, derandomize=True, max_examples=15)

INPUT = OperatorInput(seq=3, echo=Stamp("a1b2", 7), lease_id="l", coupling_id=2, position_m=(0.1, 0.2))


def packed(content: object) -> bytes:
    return msgpack.Packer().pack(content)


def fault(data: bytes, kind: type[Message]) -> InvalidMessage:
    with pytest.raises(InvalidMessage) as caught:
        decode(data, kind)
    assert kind.__name__ in str(caught.value)
    assert "\n" not in str(caught.value)
    return caught.value


@by_kind
@quick
@given(data=st.data())
def test_every_message_comes_back_as_it_was_sent(kind, data):
    message = data.draw(instances(kind))
    assert decode(encode(message), kind) == message


@by_kind
@quick
@given(data=st.data())
def test_a_number_that_is_not_finite_is_refused_and_its_place_named(kind, data):
    message = plain(data.draw(instances(kind)))
    places = floats_in(message)
    if not places:
        return
    path, keys = data.draw(st.sampled_from(places))
    message = where = _lists(message)
    for key in keys[:-1]:
        where = where[key]
    where[keys[-1]] = data.draw(st.sampled_from([math.nan, math.inf, -math.inf]))
    assert fault(packed(message), kind).field == path


@by_kind
@quick
@given(data=st.data())
def test_an_unknown_field_is_refused_and_named(kind, data):
    message = plain(data.draw(instances(kind)))
    error = fault(packed(message | {"surprise": 1}), kind)
    assert "surprise" in str(error)


@by_kind
@quick
@given(data=st.data())
def test_a_field_of_a_wrong_type_is_refused_and_named(kind, data):
    message = plain(data.draw(instances(kind)))
    schema = next(name for name in ("schema", "v") if name in message)
    name = data.draw(st.sampled_from(sorted(message.keys() - {schema}) or [schema]))
    error = fault(packed(message | {name: {"not": "this"}}), kind)
    assert error.field.startswith(name if name != schema else "schema")


@by_kind
@quick
@given(data=st.data())
def test_a_truncated_message_is_refused(kind, data):
    whole = encode(data.draw(instances(kind)))
    fault(whole[: data.draw(st.integers(0, len(whole) - 1))], kind)


@pytest.mark.parametrize("kind", sorted(set(KINDS) - set(ANY_VERSION), key=KINDS.index))
@pytest.mark.parametrize("theirs", [0, 1, 3, 99, -1, "2", None, 2.5])
def test_another_schema_is_refused_by_its_number_before_any_field_is_looked_at(kind, theirs):
    field = "v" if kind is Telemetry else "schema"  # its short name
    error = fault(packed({field: theirs, "surprise": 1}), kind)
    assert error.field == "schema" and repr(theirs) in error.expected


@pytest.mark.parametrize("theirs", [1, 3, 99])
def test_a_stop_and_its_acknowledgement_are_understood_in_every_version(theirs):
    stop, ack = (
        Stop(stop_id="s", site_name="ann"),
        StopAck(stop_id="s", standing=True, stamp=Stamp("boot", 1)),
    )
    for message in (stop, ack):
        arrived = decode(packed(plain(message) | {"schema": theirs}), type(message))
        assert structs.replace(arrived, schema=SCHEMA) == message
    for wrong in (0, -1, "2", None, 2.5, True):
        assert fault(packed(plain(stop) | {"schema": wrong}), Stop).field == "schema"


@by_kind
@quick
@given(data=st.binary(max_size=300))
def test_random_bytes_never_raise_anything_else(kind, data):
    with contextlib.suppress(InvalidMessage):
        decode(data, kind)


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text(max_size=5)
    | st.binary(max_size=5) | st.builds(msgpack.Timestamp, st.integers(0, 2**32)) | st.just(msgpack.ExtType(3, b"x")),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3) | st.binary(max_size=3), inner, max_size=3),
    max_leaves=8,
)  # fmt: skip


@by_kind
@settings(deadline=None, derandomize=True, max_examples=40)
@given(data=st.data())
def test_well_formed_maps_with_foreign_content_never_raise_anything_else(kind, data):
    message = plain(data.draw(instances(kind)))
    names = sorted(message)
    foreign = data.draw(st.dictionaries(st.sampled_from(names) | st.binary(max_size=3), ANYTHING, max_size=3))
    with contextlib.suppress(InvalidMessage):
        decode(packed(message | foreign), kind)


def test_something_that_is_not_a_map_is_refused():
    assert "map of fields" in fault(packed([1, 2]), Stop).expected


def test_nested_brackets_without_end_are_refused():
    fault(b"\x91" * 100_000, Stop)


def test_text_that_is_not_utf8_is_refused():
    fault(packed({"schema": 1, "stop_id": "x", "site_name": "y"}).replace(b"\xa1y", b"\xa1\xff"), Stop)


def test_more_bytes_than_any_message_has_are_not_even_unpacked():
    assert "at most" in fault(b"\x00" * (MAX_BYTES + 1), ModelTransfer).expected


def longest(described: inspect.Type) -> Any:  # noqa: C901 (a case per type of field)
    """The longest value of a field: text of four bytes a character, lists and bytes as long as they may be."""
    match described:
        case inspect.StrType(pattern=names.PATTERN, max_length=most):
            return "x" * (most or 0)
        case inspect.StrType(pattern=pattern, max_length=most):
            return "0" * 64 if "a-f" in (pattern or "") else "\U0001d11e" * (most or 0)
        case inspect.BytesType(max_length=most):
            return b"\x01" * (most or 0)
        case inspect.IntType(le=most):
            return 2**63 - 1 if most is None else most
        case inspect.FloatType(le=most):
            return 3e38 if most is None else most
        case inspect.VarTupleType(item_type=item, max_length=most):
            assert most is not None, "a list without bound"
            return tuple(longest(item) for _ in range(most))
        case inspect.TupleType(item_types=items):
            return tuple(map(longest, items))
        case inspect.EnumType(cls=kind):
            return max(kind, key=lambda member: len(str(member.value)))
        case inspect.UnionType(types=types):
            return longest(next(each for each in types if not isinstance(each, inspect.NoneType)))
        case inspect.StructType(cls=kind, fields=fields):
            return kind(**{f.name: longest(f.type) for f in fields if f.name != "schema"})
    return True


@pytest.mark.parametrize("kind", all_kinds(), ids=lambda kind: kind.__name__)
def test_the_longest_message_of_every_class_still_fits(kind):
    if kind is EventsReply:  # of events, the robot gives as many at a time as fit
        longest_event = longest(inspect.type_info(Event))
        events = Events(lambda *_: None, lambda: Stamp("boot", 1), lambda **_: None)
        events._recent.extend([longest_event] * 64)
        reply = events.answer(EventsRequest())
        assert 1 < len(reply.events) < 64 and len(encode(reply)) <= MAX_BYTES
        return
    channel = {flow.sent: flow.channel for flow in FLOWS}.get(kind)
    most_bytes = channel.most_bytes if channel is not None else MAX_BYTES  # an answer has no key of its own
    assert len(encode(longest(inspect.type_info(kind)))) <= most_bytes <= MAX_BYTES


@pytest.mark.parametrize("position", [[0.1], [0.1, 0.2, 0.3, 0.4], [], [[0.1, 0.2]], 0.1, ["a", "b"]])
def test_a_position_of_a_wrong_shape_is_refused(position):
    error = fault(packed(plain(INPUT) | {"position_m": position}), OperatorInput)
    assert error.field.startswith("position_m")


@pytest.mark.parametrize("enormous", [1e300, -1e7])
def test_a_position_off_this_world_is_refused(enormous):
    error = fault(packed(plain(INPUT) | {"position_m": [0.0, enormous]}), OperatorInput)
    assert error.field.startswith("position_m")


def test_a_missing_field_is_refused_and_named():
    message = plain(INPUT)
    del message["echo"]
    assert "echo" in str(fault(packed(message), OperatorInput))


def test_a_message_of_another_class_is_refused():
    fault(encode(INPUT), Heartbeat)
    fault(encode(Stop(stop_id="s", site_name="here")), Command)


def test_an_id_that_is_too_long_is_refused():
    assert fault(encode(Stop(stop_id="x" * 65, site_name="here")), Stop).field == "stop_id"


@pytest.mark.parametrize(
    "names", [(), ("task",) * (MOST_TASKS + 1), ("x" * 65,)], ids=["none", "many", "long"]
)
def test_a_robot_that_names_no_task_too_many_or_one_too_long_is_refused(names: tuple[str, ...]):
    reply = LeaseReply(
        granted=False, lease_id="", holder="", stamp=Stamp("boot", 0), tasks=names, n_dims=3
    )  # fmt: skip
    assert fault(encode(reply), LeaseReply).field.startswith("tasks")


def _lists(value: Any) -> Any:
    """A copy in which every sequence can be written to."""
    if isinstance(value, dict):
        return {key: _lists(inner) for key, inner in value.items()}
    return [_lists(inner) for inner in value] if isinstance(value, list | tuple) else value
