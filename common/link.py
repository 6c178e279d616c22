"""The connection between the two sites. The only file that speaks Zenoh.

A lost put raises nothing and a slow callback would freeze the whole session, so: every channel has its
own bounded boxes, sending is done by one thread per urgency, receiving by one thread per channel, and
nothing is trusted to have arrived until the other site's application says so.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from typing import Any, Protocol

import msgspec
import zenoh

from common.errors import LinkError
from common.keys import Channel, Urgency
from common.log import loop_logger
from common.outbox import Outbox

_log = loop_logger(__name__)

Deliver = Callable[[bytes], None]


class Request(Protocol):
    """A question of the other site that waits for its answer."""

    @property
    def data(self) -> bytes:
        """What was asked."""
        ...

    def answer(self, data: bytes) -> None:
        """Answer it, from any thread, without blocking."""
        ...


class Link(Protocol):
    """What a site needs of a connection."""

    def send(self, channel: Channel, data: bytes) -> None:
        """Hand a message over for sending; never blocks, says nothing about its arrival."""
        ...

    def subscribe(self, channel: Channel, deliver: Deliver) -> None:
        """Have each message of a channel delivered, from a thread of the link's own."""
        ...

    def serve(self, channel: Channel, handle: Callable[[Request], None]) -> None:
        """Have each question on a channel handed over, from a thread of the link's own."""
        ...

    def ask(self, channel: Channel, data: bytes, timeout_s: float) -> bytes | None:
        """Ask the other site and wait. None when no answer came: it was perhaps not delivered."""
        ...

    def close(self) -> None:
        """End the connection and all its threads."""
        ...


class EndpointSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where the transport listens and connects. The remote site listens, the local site connects."""

    vehicle: str = "rov1"
    """Name of the vehicle: the namespace of all keys."""
    listen: str = ""
    """Endpoint to listen on, such as tcp/127.0.0.1:7447."""
    connect: str = ""
    """Endpoint to connect to: the other site or the link process."""
    lease_s: float = 120.0
    """Silence after which the transport itself gives up [s]; the application notices much earlier."""
    handshake_timeout_s: float = 60.0
    """Longest time for a connection to open [s]; a handshake takes four one-way delays."""


def zenoh_configuration(settings: EndpointSettings) -> dict[str, Any]:
    """The transport's configuration: one explicit connection and nothing found by itself."""
    handshake_ms = round(settings.handshake_timeout_s * 1000)
    return {
        "mode": "peer",
        "namespace": settings.vehicle,
        "listen": {"endpoints": [settings.listen] if settings.listen else []},
        "connect": {
            "endpoints": [settings.connect] if settings.connect else [],
            "timeout_ms": -1,
            "exit_on_failure": False,
            "retry": {"period_init_ms": 200, "period_max_ms": 500, "period_increase_factor": 1.5},
        },
        # Gossip would let the sites connect directly, past the link process.
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "timestamping": {"enabled": True},
        "queries_default_timeout": handshake_ms,
        "transport": {
            "unicast": {"open_timeout": handshake_ms, "accept_timeout": handshake_ms},
            "shared_memory": {"enabled": False},
            "link": {
                "tx": {
                    "lease": round(settings.lease_s * 1000),
                    "keep_alive": 4,
                    "queue": {
                        "size": {"real_time": 16, "interactive_high": 16, "data_high": 16},
                        "congestion_control": {
                            "drop": {"wait_before_drop": 20_000},
                            "block": {"wait_before_close": 120_000_000},
                        },
                    },
                }
            },
        },
    }


class _ZenohRequest:
    def __init__(self, query: zenoh.Query, channel: Channel, outbox: Outbox):
        self._query, self._channel, self._outbox = query, channel, outbox
        self.data = query.payload.to_bytes() if query.payload else b""

    def answer(self, data: bytes) -> None:
        self._outbox.submit(lambda: self._reply(data))

    def _reply(self, data: bytes) -> None:
        with self._query:
            self._query.reply(self._channel.key, data, express=True)  # with the question's priority


class ZenohLink:
    """A `Link` over one Zenoh session.

    Args:
        settings: The endpoints.

    Raises:
        LinkError: When the endpoint cannot be listened on or is not understood.
    """

    def __init__(self, settings: EndpointSettings):
        try:
            configuration = zenoh.Config.from_json5(json.dumps(zenoh_configuration(settings)))
            self._session = zenoh.open(configuration)
        except zenoh.ZError as error:
            where = settings.listen or settings.connect
            raise LinkError(
                f"{where}: cannot be opened; is the port in use? ({_first_line(error)})"
            ) from error
        self._outboxes = {urgency: Outbox(urgency.name.lower(), _log) for urgency in Urgency}
        self._publishers: dict[Channel, zenoh.Publisher] = {}
        self._threads: list[threading.Thread] = []
        self._lock = threading.Lock()
        self._closed = False

    def send(self, channel: Channel, data: bytes) -> None:
        """See `Link.send`."""
        publisher = self._publisher(channel)
        newest_only = None if channel.must_arrive else channel.key
        self._outboxes[channel.urgency].submit(lambda: publisher.put(data), newest_only, len(data))

    def limit(self, channel: Channel, bytes_per_s: float) -> None:
        """Give a newest-only channel a byte budget [B/s]: what does not fit is skipped, not queued."""
        self._outboxes[channel.urgency].limit(channel.key, bytes_per_s)

    def subscribe(self, channel: Channel, deliver: Deliver) -> None:
        """See `Link.subscribe`."""
        subscriber = self._session.declare_subscriber(channel.key, zenoh.handlers.RingChannel(channel.keep))
        self._receive(channel, subscriber.recv, lambda sample: deliver(sample.payload.to_bytes()))

    def serve(self, channel: Channel, handle: Callable[[Request], None]) -> None:
        """See `Link.serve`."""
        queryable = self._session.declare_queryable(channel.key, zenoh.handlers.FifoChannel(64))
        outbox = self._outboxes[channel.urgency]
        self._receive(channel, queryable.recv, lambda query: handle(_ZenohRequest(query, channel, outbox)))

    def ask(self, channel: Channel, data: bytes, timeout_s: float) -> bytes | None:
        """See `Link.ask`."""
        if self._closed:
            return None
        replies = self._session.get(
            channel.key, payload=data, timeout=timeout_s, express=True, priority=_priority(channel),
            congestion_control=zenoh.CongestionControl.BLOCK,
        )  # fmt: skip
        for reply in replies:
            if reply.ok is not None:
                return reply.ok.payload.to_bytes()
        return None

    def close(self) -> None:
        """See `Link.close`. Without it the interpreter would hang at its exit."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        for outbox in self._outboxes.values():
            outbox.close()
        self._session.close()
        for thread in self._threads:
            thread.join(timeout=5.0)

    def _publisher(self, channel: Channel) -> zenoh.Publisher:
        with self._lock:
            if channel not in self._publishers:
                control = zenoh.CongestionControl
                self._publishers[channel] = self._session.declare_publisher(
                    channel.key,
                    priority=_priority(channel),
                    congestion_control=control.BLOCK if channel.must_arrive else control.DROP,
                    express=channel.urgency is not Urgency.BULK,
                )
            return self._publishers[channel]

    def _receive(self, channel: Channel, take: Callable[[], Any], hand_over: Callable[[Any], None]) -> None:
        """Read a channel in a thread of its own until the session closes."""

        def run() -> None:
            while True:
                try:
                    item = take()
                except zenoh.ZError:
                    return  # the session was closed
                try:
                    hand_over(item)
                except Exception:
                    _log.exception("a message on %s could not be handled", channel.key)
                item = None  # a question that was dropped ends now, not with the next one

        thread = threading.Thread(target=run, name=f"receive {channel.key}", daemon=True)
        thread.start()
        self._threads.append(thread)


def _priority(channel: Channel) -> zenoh.Priority:
    return getattr(zenoh.Priority, channel.urgency.value)


def _first_line(error: Exception) -> str:
    return str(error).split(" at /")[0].splitlines()[0][:200]
