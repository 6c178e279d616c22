"""Link: connection between the two sites. The only file that speaks Zenoh.

A lost put raises nothing. Therefore one thread per urgency sends, and nothing counts as arrived until the other
site's application says so. What arrives is judged at once by the thread that reads this one connection, before it
waits anywhere: nothing that is not understood takes a place from what is, and whoever sends too much is read more
slowly, and nobody else.
"""

from __future__ import annotations

import json
import os
import queue
import threading
import time
from collections.abc import Callable
from typing import Any, Protocol

import zenoh

from farhand.common.address import listening_fault
from farhand.common.errors import LinkError, PortTaken
from farhand.common.link.certificates import check_site_certificate
from farhand.common.link.connection_faults import DeafListeners
from farhand.common.link.endpoint import MOST_SESSIONS, EndpointSettings, scheme_of, zenoh_configuration
from farhand.common.link.outbox import Outbox, SilenceGate
from farhand.common.log import loop_logger
from farhand.common.wire.keys import Channel, Urgency

_log = loop_logger(__name__)

OVERHEAD_BYTES = 70
"""Bytes that Zenoh (about 30), TCP and IP (40) add to a message, for its budget [B]."""

# One reader for each connection, so that a slow or paused one holds up no other; read when the first session opens.
os.environ.setdefault("ZENOH_RUNTIME", f"(rx: (worker_threads: {MOST_SESSIONS + 1}))")
_PAUSE_S = 0.002
"""Shortest pause in reading a connection after a message that was not wanted [s]."""
_PAUSES = 9
"""The pause in durations of its reading: a flood has a tenth of one processor at most."""

Deliver = Callable[[bytes], bool | None]
"""Takes a message, without blocking; returns False when it was not wanted: its sender must slow down."""
Answered = Callable[[bytes | None], None]


class Request(Protocol):
    """Question of the other site that waits for its answer."""

    @property
    def data(self) -> bytes:
        """The question."""
        ...

    def answer(self, data: bytes) -> None:
        """Answer it, from any thread, without blocking."""
        ...


Handle = Callable[[Request], bool | None]
"""The same for a question."""


class Link(Protocol):
    """Interface of a site's connection."""

    def send(self, channel: Channel, data: bytes) -> None:
        """Hand a message over for sending; never blocks, and gives no information about its arrival."""
        ...

    def subscribe(self, channel: Channel, deliver: Deliver) -> None:
        """Have each message of a channel delivered, from the thread that reads its connection."""
        ...

    def serve(self, channel: Channel, handle: Handle) -> None:
        """Have each question on a channel handed over in the same way."""
        ...

    def limit(self, channel: Channel, bytes_per_s: float) -> None:
        """Give a newest-only channel a byte budget [B/s]; messages beyond it are skipped, not queued."""
        ...

    def ask(self, channel: Channel, data: bytes, timeout_s: float, answered: Answered) -> None:
        """Ask the other site; never blocks.

        Args:
            channel: Channel on which it is served.
            data: The question.
            timeout_s: Time-out [s].
            answered: Called at most once, from a thread of the link's own, and must not block. None: no
                answer came, and perhaps the question was not delivered. A link that is closed before may
                not call it.
        """
        ...

    def close(self) -> None:
        """End the connection and all its threads."""
        ...


class _ZenohRequest:
    def __init__(self, query: zenoh.Query, channel: Channel, outbox: Outbox):
        self._query, self._channel, self._outbox = query, channel, outbox
        self.data = query.payload.to_bytes() if query.payload else b""

    def answer(self, data: bytes) -> None:
        self._outbox.submit(lambda: self._reply(data))

    def _reply(self, data: bytes) -> None:
        with self._query:
            self._query.reply(self._channel.key, data, express=True)  # with the question's priority


class _Question:
    """Receiver that passes on the first reply, or None at the end of all replies."""

    def __init__(self, answered: Answered):
        self._answered: Answered | None = answered

    def on_reply(self, reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            self._give(reply.ok.payload.to_bytes())

    def on_end(self) -> None:
        self._give(None)

    def _give(self, data: bytes | None) -> None:
        answered, self._answered = self._answered, None
        if answered is not None:
            answered(data)


class ZenohLink:
    """`Link` over one Zenoh session.

    Args:
        settings: The endpoints.
        dropped: Called with a description of each listener that was dropped because it read nothing; from a
            thread of the link's own.

    Raises:
        LinkError: When the endpoint cannot be listened on or is not understood.
    """

    def __init__(self, settings: EndpointSettings, dropped: Callable[[str], None] = _log.warning):
        if settings.certificates:
            check_site_certificate(settings.certificate_folder, _log.warning)
        try:
            configuration = zenoh.Config.from_json5(json.dumps(zenoh_configuration(settings)))
            self._session = zenoh.open(configuration)
        except zenoh.ZError as error:
            where = settings.listen or settings.connect
            first_line = str(error).split(" at /")[0].splitlines()[0][:200]
            why = listening_fault(settings.listen) if settings.listen else ""
            kind = PortTaken if "is in use" in why else LinkError
            raise kind(f"{where}: {why or f'cannot be opened ({first_line})'}") from error
        is_quic = scheme_of(settings.listen or settings.connect) == "quic"
        self._gate = SilenceGate(settings.rate_bps) if is_quic else None
        self._deaf = DeafListeners(self.connected_to, settings.listen, dropped) if settings.listen else None
        held_up = self._deaf.look if self._deaf is not None else lambda: None
        self._outboxes = {urgency: Outbox(urgency.name.lower(), _log, held_up) for urgency in Urgency}
        self._publishers: dict[Channel, zenoh.Publisher] = {}
        self._declared: list[zenoh.Subscriber[None] | zenoh.Queryable[None]] = []
        self._lock = threading.Lock()
        self._closed = False

    def send(self, channel: Channel, data: bytes) -> None:
        """See `Link.send`."""
        newest_only = None if channel.must_arrive else channel.key
        if newest_only is not None and self._gate is not None and not self._gate.lets_out(len(data)):
            return
        self._outboxes[channel.urgency].submit(
            lambda: self._publisher(channel).put(data), newest_only, len(data) + OVERHEAD_BYTES
        )

    def limit(self, channel: Channel, bytes_per_s: float) -> None:
        """See `Link.limit`."""
        self._outboxes[channel.urgency].limit(channel.key, bytes_per_s)

    def subscribe(self, channel: Channel, deliver: Deliver) -> None:
        """See `Link.subscribe`."""
        take = self._taker(channel, lambda sample: deliver(sample.payload.to_bytes()))
        self._declared.append(self._session.declare_subscriber(channel.key, take))

    def serve(self, channel: Channel, handle: Handle) -> None:
        """See `Link.serve`."""
        outbox = self._outboxes[channel.urgency]
        take = self._taker(channel, lambda query: handle(_ZenohRequest(query, channel, outbox)))
        self._declared.append(self._session.declare_queryable(channel.key, take))

    def ask(self, channel: Channel, data: bytes, timeout_s: float, answered: Answered) -> None:
        """See `Link.ask`."""
        question = _Question(answered)
        # In the network's own thread: a thread per question would cost more than the question.
        handler = zenoh.handlers.Callback(question.on_reply, question.on_end, indirect=False)

        def get() -> None:
            self._session.get(
                channel.key, handler, payload=data, timeout=timeout_s, express=True,
                priority=getattr(zenoh.Priority, channel.urgency.value), congestion_control=zenoh.CongestionControl.BLOCK,
            )  # fmt: skip

        self._outboxes[channel.urgency].submit(get)

    def ask_and_wait(self, channel: Channel, data: bytes, timeout_s: float) -> bytes | None:
        """Ask the other site and wait for its answer. None when none came."""
        answers: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self.ask(channel, data, timeout_s, answers.put)
        try:
            return None if self._closed else answers.get(timeout=timeout_s + 1.0)
        except queue.Empty:
            return None

    def close(self) -> None:
        """See `Link.close`. Without it the interpreter would hang at its exit."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        if self._deaf is not None:
            self._deaf.close()
        for outbox in self._outboxes.values():
            outbox.close()
        self._session.close()

    def connected_to(self) -> list[str]:
        """Return the locators of the other ends that are connected."""
        return [link.dst for link in self._session.info.links()]

    def _publisher(self, channel: Channel) -> zenoh.Publisher:
        """Return the publisher of a channel.

        Called by the thread of its urgency alone, as it may wait for the network.
        """
        if channel not in self._publishers:
            control, reliability = zenoh.CongestionControl, zenoh.Reliability
            self._publishers[channel] = self._session.declare_publisher(
                channel.key,
                priority=getattr(zenoh.Priority, channel.urgency.value),
                congestion_control=control.BLOCK if channel.must_arrive else control.DROP,
                express=channel.urgency is not Urgency.BULK,
                # Over TCP nothing is lost, and this has no effect.
                reliability=reliability.RELIABLE if channel.sent_again else reliability.BEST_EFFORT,
            )
        return self._publishers[channel]

    def _taker(self, channel: Channel, take: Callable[[Any], bool | None]) -> Any:
        """Return what takes each item of a channel in the thread that reads its connection."""

        def hear(item: Any) -> None:
            if self._gate is not None:
                self._gate.heard()
            began_s = time.thread_time()
            try:
                wanted = item.payload is None or len(item.payload) <= channel.most_bytes
                if not wanted:
                    _log.warning("dropped: more than %d bytes on %s", channel.most_bytes, channel.key)
                wanted = wanted and take(item)
            except Exception:
                _log.exception("a message on %s could not be handled", channel.key)
                return
            if wanted is False:
                time.sleep(max(_PAUSE_S, _PAUSES * (time.thread_time() - began_s)))

        return zenoh.handlers.Callback(hear, indirect=False)
