"""Generator of docs/protocol.md from the code: `python -m docs.protocol_page`."""

from __future__ import annotations

import ast
import inspect
import re
from pathlib import Path
from typing import NamedTuple

import msgspec

from docs.protocol_words import ERRORS, HEAD, SHARED_FIELDS, TAIL
from farhand.common.link.budget import budget_bytes_s
from farhand.common.wire import keys, messages
from farhand.common.wire.codec import MAX_BYTES
from farhand.common.wire.keys import Channel
from farhand.common.wire.messages import ArmState, Message, PictureView, RecordingOffer, Stamp
from farhand.common.wire.reason_words import WORDS
from farhand.common.wire.reasons import Reason, Value

PAGE = Path(__file__).parent / "protocol.md"
_UNITS = {"_m": "m", "_s": "s", "_ms": "ms", "_ns": "ns", "_rad": "rad"}


class ChannelFlow(NamedTuple):
    """Messages of a channel.

    Args:
        channel: The channel.
        sent: The message.
        answered: The answer to it, for a query.
    """

    channel: Channel
    sent: type[Message]
    answered: type[Message] | None = None


FLOWS = (
    ChannelFlow(keys.STOP, messages.Stop),
    ChannelFlow(keys.COMMAND, messages.Command, messages.CommandReply),
    ChannelFlow(keys.LEASE, messages.LeaseRequest, messages.LeaseReply),
    ChannelFlow(keys.INPUT, messages.OperatorInput),
    ChannelFlow(keys.HEARTBEAT, messages.Heartbeat),
    ChannelFlow(keys.TARGET, messages.MoveTarget),
    ChannelFlow(keys.MODEL, messages.ModelTransfer, messages.ModelReply),
    ChannelFlow(keys.REPORT, messages.ReportRequest, messages.ExecutionReport),
    ChannelFlow(keys.EVENTS, messages.EventsRequest, messages.EventsReply),
    ChannelFlow(keys.CATALOGUE, messages.CatalogueRequest, messages.CatalogueReply),
    ChannelFlow(keys.BLOB, messages.BlobRequest, messages.BlobReply),
    ChannelFlow(keys.CAMERA, messages.CameraRequest, messages.CameraReply),
    ChannelFlow(keys.STOP_ACK, messages.StopAck),
    ChannelFlow(keys.TELEMETRY, messages.Telemetry),
    ChannelFlow(keys.EVENT, messages.Event),
    ChannelFlow(keys.PATH, messages.PlannedPath),
    ChannelFlow(keys.PICTURE, messages.CameraPicture),
)


def page() -> str:
    """Return the whole page."""
    kinds = [kind for flow in FLOWS for kind in (flow.sent, flow.answered) if kind is not None]
    parts = [
        HEAD.format(schema=messages.SCHEMA, max_bytes=MAX_BYTES, telemetry=messages.MAX_TELEMETRY_BYTES),
        _keys(),
        "## Messages",
        _stamp(),
        _message(ArmState, " An array of four, in this order."),
        _message(RecordingOffer, " An array of four, in this order."),
        _message(PictureView, " An array of three, in this order."),
        _message(Reason, " An array of two, in this order."),
        _message(Value, " An array of two, in this order."),
        *map(_message, kinds),
        "## Errors",
        _table(["where", "words", "when", "then"], [error[:4] for error in ERRORS]),
        "## Reasons",
        _reasons(),
        TAIL,
    ]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def meaning(kind: type[msgspec.Struct], field: str) -> str:
    """Return the description of a field: its own, or that of its name elsewhere; empty when it has none."""
    return _docstrings(kind).get(field) or SHARED_FIELDS.get(field, "")


def _keys() -> str:
    header = ["key", "direction", "how", "messages", "urgency", "over QUIC", "full queue", "most B", "share"]
    rows = []
    for channel, sent, answered in FLOWS:
        over_quic = "both ways" if channel.both_ways else "datagram" if channel.is_streamed else "stream"
        names = f"{_link(sent)} → {_link(answered)}" if answered else _link(sent)
        share = budget_bytes_s(channel, 8.0)
        rows.append([
            f"`{channel.of('SITE')}`", "operator → robot" if channel.is_to_robot else "robot → operators",
            "query" if answered else "put", names, channel.urgency.name, over_quic,
            "waits" if channel.must_arrive else "newest only", str(channel.most_bytes),
            f"{share:.0%}" if share else "",
        ])  # fmt: skip
    return _table(header, rows)


def _reasons() -> str:
    """Return the table of all codes; their values are the names in their sentences."""
    return _table(["code", "values and words"], [[f"`{code}`", words] for code, words in WORDS.items()])


def _stamp() -> str:
    return f"### Stamp\n{inspect.getdoc(Stamp)} An array of two: `boot` (str), `t_ns` (int, at least 0)."


def _message(kind: type[msgspec.Struct], words: str = "") -> str:
    rows = []
    for field in msgspec.structs.fields(kind):
        alias = "" if field.encode_name == field.name else f" (`{field.encode_name}`)"
        required = field.required or field.name == "schema"
        default = "" if required else f", {_text(field.default)} if absent"
        rows.append([f"`{field.name}`{alias}", _type(kind, field.name) + default, _unit(kind, field.name),
                     meaning(kind, field.name)])  # fmt: skip
    return f"### {kind.__name__}\n{inspect.getdoc(kind)}{words}\n\n" + _table(
        ["field", "type", "unit", ""], rows
    )


def _text(default: object) -> str:
    """Return a default as it is sent."""
    if isinstance(default, str):
        return f'"{default}"'
    return {None: "nil", (): "empty"}.get(default, str(default).lower())


def _unit(kind: type[msgspec.Struct], name: str) -> str:
    if name.startswith("n_"):
        return ""  # a count has no unit
    for suffix, unit in _UNITS.items():
        if name.endswith(suffix):
            return unit
    if found := re.search(r"\[(\w+)\]", meaning(kind, name)):
        return found[1]
    return ""


def _type(kind: type[msgspec.Struct], name: str) -> str:
    described = msgspec.inspect.type_info(kind)
    assert isinstance(described, msgspec.inspect.StructType)
    return _described(next(field.type for field in described.fields if field.name == name))


def _described(kind: msgspec.inspect.Type) -> str:
    """Return a type in words, with its bounds."""
    match kind:
        case msgspec.inspect.UnionType(types=types):
            return " or ".join(map(_described, types))
        case msgspec.inspect.EnumType(cls=cls):
            return " / ".join(f'"{value.value}"' for value in cls)
        case msgspec.inspect.StructType(cls=cls):
            return cls.__name__
        case msgspec.inspect.VarTupleType(item_type=item, min_length=least, max_length=most):
            count = f"{least} to {most} " if least and most else f"at most {most} " if most else ""
            return f"array of {count}{_described(item)}"
        case msgspec.inspect.TupleType(item_types=items):
            return f"array of {len(items)} {_described(items[0])}"
        case msgspec.inspect.NoneType():
            return "nil"
    name = type(kind).__name__.removesuffix("Type").lower()
    bounds = {"ge": "≥ {:,}", "gt": "> {:,}", "le": "≤ {:,}", "lt": "< {:,}", "max_length": "at most {:,} long",
              "pattern": "`{}`"}  # fmt: skip
    said = [
        text.format(value) for key, text in bounds.items() if (value := getattr(kind, key, None)) is not None
    ]
    return f"{name} {', '.join(said)}".strip()


def _docstrings(kind: type) -> dict[str, str]:
    """Return the string after each field of a class."""
    (tree,) = ast.parse(inspect.getsource(kind)).body
    assert isinstance(tree, ast.ClassDef)
    found: dict[str, str] = {}
    for field, after in zip(tree.body, tree.body[1:], strict=False):
        match field, after:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(words))):
                found[name] = " ".join(words.split())
    return found


def _link(kind: type[Message]) -> str:
    return f"[{kind.__name__}](#{kind.__name__.lower()})"


def _table(header: list[str], rows: list) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
