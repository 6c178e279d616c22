"""Control protocol of the link process and its client: one line of JSON per request, one per answer.

The protocol has a socket of its own, so it works while the simulated link is down.

    {"request": "status"}
    {"request": "profile", "name": "geo"}
    {"request": "set", "uplink": {"delay_ms": 600}, "downlink": {}}
    {"request": "outage", "kind": "stall", "duration_s": 10}
    {"request": "clear"}
    {"request": "rebind"}

Every answer is {"status": {...}} with the state after the request, or {"error": {...}} if nothing was changed.
"""

from __future__ import annotations

import socket
from collections.abc import Mapping
from typing import Any

import msgspec

from farhand.common.address import show_address
from farhand.common.errors import InvalidConfiguration, InvalidInput, InvalidMessage, LinkError
from farhand.common.impairment.impairment import Outage
from farhand.common.wire.codec import field_of

CONTROL_PORT = 7449
MAX_LINE_BYTES = 65536


class _Request(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Common base of all requests."""


class StatusRequest(_Request, frozen=True, tag_field="request", tag="status"):
    """Request for the present state."""


class ProfileRequest(_Request, frozen=True, tag_field="request", tag="profile"):
    """Request to apply the settings of a profile."""

    name: str


class SetRequest(_Request, frozen=True, tag_field="request", tag="set"):
    """Request to replace some fields of `DirectionSettings`, in both directions or neither."""

    uplink: dict[str, Any] = {}
    downlink: dict[str, Any] = {}


class OutageRequest(_Request, frozen=True, tag_field="request", tag="outage"):
    """Request to interrupt the link."""

    kind: Outage
    duration_s: float = 0.0


class ClearRequest(_Request, frozen=True, tag_field="request", tag="clear"):
    """Request to end the present outage."""


class RebindRequest(_Request, frozen=True, tag_field="request", tag="rebind"):
    """Request to continue from other ports towards the remote site, as after a satellite hand-over; only UDP survives it."""


Request = StatusRequest | ProfileRequest | SetRequest | OutageRequest | ClearRequest | RebindRequest


class Refusal(msgspec.Struct, frozen=True, kw_only=True):
    """Reason of a refused request: the arguments of `InvalidInput`."""

    source: str
    field: str
    expected: str


class Answer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Answer with exactly one of its two fields."""

    status: dict[str, Any] | None = None
    error: Refusal | None = None


class ForeignLine(InvalidMessage):
    """Line of another protocol."""


def decode_request(line: bytes | None) -> Request:
    """Return the request in a line; None stands for a line that was too long.

    Raises:
        ForeignLine: When the line is not a JSON object.
        InvalidMessage: When the object is not a request; names the field.
    """
    try:
        return msgspec.json.decode(_object(line), type=Request)
    except msgspec.ValidationError as error:
        raise InvalidMessage("link request", *field_of(error)) from error


def _object(line: bytes | None) -> msgspec.Raw:
    """Return the line's JSON object in UTF-8."""
    if line is None:
        raise ForeignLine("link request", "", f"expected a line of at most {MAX_LINE_BYTES} bytes")
    try:
        line.decode()
        if isinstance(msgspec.json.decode(line), dict):
            return msgspec.Raw(line)
        reason = "not an object"
    except (UnicodeDecodeError, msgspec.DecodeError, RecursionError) as error:
        reason = str(error)
    raise ForeignLine("link request", "", f"expected one line of JSON, an object: {reason}"[:300])


def refuse(error: InvalidInput) -> Answer:
    """Return the answer to a refused request."""
    return Answer(error=Refusal(source=error.source, field=error.field, expected=error.expected))


class RelayControl:
    """Client of the link process. It opens a connection per request, so it outlives a restart of the link.

    Every method returns the link's status after the request.

    Args:
        host: Host of the link's control socket.
        port: Port of the link's control socket.
        timeout_s: Longest wait for an answer [s].

    Raises:
        LinkError: (each method) The link process cannot be reached or does not answer.
        InvalidConfiguration: (each method) The link process refused the request and changed nothing; names the field.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = CONTROL_PORT, timeout_s: float = 5.0):
        self._host, self._port, self._timeout_s = host, port, timeout_s

    def status(self) -> dict[str, Any]:
        """Ask for settings, outage, connections, traffic and the relay's own lateness."""
        return self._ask(StatusRequest())

    def profile(self, name: str) -> dict[str, Any]:
        """Apply the settings of a profile."""
        return self._ask(ProfileRequest(name=name))

    def set(self, uplink: Mapping[str, Any] = {}, downlink: Mapping[str, Any] = {}) -> dict[str, Any]:
        """Replace some fields of `DirectionSettings` in either direction."""
        return self._ask(SetRequest(uplink=dict(uplink), downlink=dict(downlink)))

    def outage(self, kind: Outage, duration_s: float) -> dict[str, Any]:
        """Interrupt the link for a duration [s]: `stall`, `reset` or `blackhole`."""
        return self._ask(OutageRequest(kind=kind, duration_s=duration_s))

    def clear(self) -> dict[str, Any]:
        """End the present outage."""
        return self._ask(ClearRequest())

    def rebind(self) -> dict[str, Any]:
        """Send later datagrams to the remote site from other UDP ports."""
        return self._ask(RebindRequest())

    def _ask(self, request: Request) -> dict[str, Any]:
        where = show_address((self._host, self._port))
        try:
            answer = msgspec.json.decode(self._exchange(msgspec.json.encode(request) + b"\n"), type=Answer)
        except OSError as error:
            reason = error.strerror or "no answer in time"
            raise LinkError(
                f"the link process does not answer at {where} ({reason}): is it running?"
            ) from error
        except (UnicodeDecodeError, msgspec.DecodeError, RecursionError) as error:
            raise LinkError(f"what answers at {where} is not a link process: {error}") from error
        if answer.error:
            raise InvalidConfiguration(answer.error.source, answer.error.field, answer.error.expected)
        if answer.status is None:
            raise LinkError(f"what answers at {where} is not a link process: it sent no status")
        return answer.status

    def _exchange(self, line: bytes) -> bytes:
        with (
            socket.create_connection((self._host, self._port), self._timeout_s) as sock,
            sock.makefile("rb") as answers,
        ):
            sock.sendall(line)
            return answers.readline(MAX_LINE_BYTES)
