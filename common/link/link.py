"""Link: connection between the two sites. This folder alone speaks Zenoh.

A lost put raises no error. Therefore one thread per urgency sends, and a message counts as arrived only when the other
site's application has confirmed it. An arriving message is judged at once by the thread that reads its connection, before
it enters any queue: malformed messages take no place in a queue, and a connection that sends too much is read more
slowly, without effect on the others.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Any

import zenoh

from farhand.common.link.access import AccessWatch
from farhand.common.link.budget import OVERHEAD_BYTES
from farhand.common.link.certificates import check_site_certificate
from farhand.common.link.connection_faults import DeafListeners
from farhand.common.link.copies import Once, Question
from farhand.common.link.endpoint import MOST_SESSIONS, EndpointSettings, scheme_of
from farhand.common.link.interface import Answered, Deliver, Handle, Signed
from farhand.common.link.outbox import Outbox
from farhand.common.link.quic import QuicDelivery, copy_of, site_in
from farhand.common.link.refusals import Refusals, serve_rights
from farhand.common.link.session import Session, ZenohRequest, in_reader, reply_to
from farhand.common.log import loop_logger
from farhand.common.wire import keys
from farhand.common.wire.keys import Channel, Urgency, answers_for

_log = loop_logger(__name__)


class ZenohLink:
    """`Link` over one Zenoh session, or two: over QUIC the streams of a site that connects have one of their own.

    Args:
        settings: The endpoints.
        dropped: Called with a description of each listener that was dropped because it read nothing, and of each
            refusal; from a thread of the link's own.

    Raises:
        LinkError: When the endpoint cannot be listened on or is not understood.
    """

    def __init__(self, settings: EndpointSettings, dropped: Callable[[str], None] = _log.warning):
        if settings.certificates:
            check_site_certificate(settings.certificate_folder, _log.warning)
        self._site = settings.speaks_as
        self._knows_senders = bool(settings.is_of_robot and settings.certificates)
        shared = settings.is_of_robot and bool(settings.connect)  # a hub's connection carries every site
        self._settings, self._refusals = settings, Refusals(dropped, slows=not shared)
        self._quic: QuicDelivery | None = None
        self._session = self._streams = Session(settings)
        self._deaf = DeafListeners(self.connected_to, settings.listen, dropped) if settings.listen else None
        held_up = self._deaf.look if self._deaf is not None else lambda: None
        self._outboxes = {urgency: Outbox(urgency.name.lower(), _log, held_up) for urgency in Urgency}
        self._limits: dict[Channel, tuple[float, float]] = {}
        self._lock = threading.Lock()
        self._closed = False
        self._access = None
        if settings.certificates:
            self._access = AccessWatch(settings.certificate_folder, settings.sites, self.reopen, self._look)
            if settings.listen:
                self._session.declare(serve_rights(self._access, settings.vehicle, self._refusals))
        if settings.is_of_robot and settings.connect:
            self._session.declare(lambda session: session.liveliness().declare_token(keys.ALIVE))
        if scheme_of(settings.endpoint) == "quic":
            self._quic = QuicDelivery(settings.rate_bps, self._put, self._set_limit)
            if settings.connect:
                # Streams have a window of their own, which nothing else fills, and so do commands.
                self._streams = Session(settings)
                key, answers = answers_for(self._site, self._quic.asker), self._quic.answered
                if not settings.is_of_robot:
                    self._session.declare(lambda session: session.declare_subscriber(key, in_reader(answers)))
                asked = keys.RIGHT.of("hub" if settings.is_of_robot else self._site)
                self._quic.watch_path(
                    settings.connect,
                    self._is_connected,
                    lambda s: all(each.answers(asked, s) for each in (self._session, self._streams)),
                    self.reopen,
                )

    def send(self, channel: Channel, data: bytes) -> None:
        """See `Link.send`."""
        quic = self._quic
        if quic is not None and not quic.lets_out(channel, len(data) + OVERHEAD_BYTES):
            return
        newest_only = None if channel.must_arrive else channel.key
        self._outboxes[channel.urgency].submit(
            lambda: quic.send(channel, data) if quic is not None else self._put(channel, data, True, None),
            newest_only,
            len(data) + OVERHEAD_BYTES,
        )

    def limit(self, channel: Channel, bytes_per_s: float) -> None:
        """See `Link.limit`."""
        self._set_limit(channel, bytes_per_s, 0)

    def subscribe(self, channel: Channel, deliver: Deliver) -> None:
        """See `Link.subscribe`."""
        key, quic = channel.of(self._site), self._quic

        def take(sample: zenoh.Sample) -> bool | None:
            if quic is not None:
                quic.arrived(channel, sample)
            return deliver(self._data(sample))

        taker = self._taker(channel, take)
        session = self._streams if channel.is_streamed else self._session
        session.declare(lambda session: session.declare_subscriber(key, taker))

    def serve(self, channel: Channel, handle: Handle) -> None:
        """See `Link.serve`."""
        key, outbox, once = channel.of(self._site), self._outboxes[channel.urgency], Once(handle)

        def take_query(query: zenoh.Query) -> bool | None:
            data = self._data(query)
            if (copy := copy_of(query)) is None:
                return handle(ZenohRequest(query, data, outbox))
            return once.take(copy[0], data, lambda answer: outbox.submit(lambda: reply_to(query, answer)))

        def take_datagram(sample: zenoh.Sample) -> bool | None:
            if (copy := copy_of(sample)) is None:
                return False
            answers = answers_for(site_in(sample), copy[1])
            return once.take(copy[0], self._data(sample), self._by_datagram(channel, answers, copy[0]))

        taker = self._taker(channel, take_query)
        self._session.declare(lambda session: session.declare_queryable(key, taker))
        if channel.both_ways and self._quic is not None:
            datagrams = self._taker(channel, take_datagram)
            self._session.declare(lambda session: session.declare_subscriber(key, datagrams))

    def ask(self, channel: Channel, data: bytes, timeout_s: float, answered: Answered) -> None:
        """See `Link.ask`."""
        question, outbox, key = Question(answered), self._outboxes[channel.urgency], channel.of(self._site)
        if self._quic is not None and not self._quic.lets_ask(channel):
            outbox.submit(question.on_end)
            return
        copied = self._quic if channel.both_ways else None
        attachment = copied.copy_attachment(question) if copied is not None else None
        # In the network's own thread: a thread per question would cost more than the question.
        handler = zenoh.handlers.Callback(self._on_reply(question), question.on_end, indirect=False)

        def get() -> None:
            try:
                self._session.get(
                    key, handler, payload=data, timeout=timeout_s, express=True, attachment=attachment,
                    priority=getattr(zenoh.Priority, channel.urgency.value), congestion_control=zenoh.CongestionControl.BLOCK,
                )  # fmt: skip
            except zenoh.ZError:
                question.on_end()  # the session is being opened again: it is asked again
                raise

        outbox.submit(get)
        if copied is not None:
            copied.ask(question, lambda: outbox.submit(lambda: self._put(channel, data, False, attachment)))

    def ask_and_wait(self, channel: Channel, data: bytes, timeout_s: float) -> bytes | None:
        """Ask the other site and wait for its answer. None when none came."""
        answers: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self.ask(channel, data, timeout_s, answers.put)
        try:
            return None if self._closed else answers.get(timeout=timeout_s + 1.0)
        except queue.Empty:
            return None

    def reopen(self) -> None:
        """Open the transport again in place, with certificates and rights as the files have them now."""
        for session in {self._session, self._streams}:
            session.reopen()

    def close(self) -> None:
        """See `Link.close`. Without it the interpreter would hang at its exit."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        for part in (
            self._access,
            self._deaf,
            self._quic,
            *self._outboxes.values(),
            self._streams,
            self._session,
        ):
            if part is not None:
                part.close()

    def connected_to(self) -> list[str]:
        """Return the locators of the other ends that are connected."""
        return self._session.locators()

    def warning(self) -> str:
        """Return what is wrong with the link's security, in words; empty if nothing is."""
        if self._settings.is_open:
            return "NOT ENCRYPTED"
        return self._access.warning() if self._access is not None else ""

    @property
    def report_gap_s(self) -> float:
        """Longest time between two reports that a lossy connection let out a moment ago [s]; 0 if all leave at once."""
        return self._quic.report_gap_s if self._quic is not None else 0.0

    def _look(self) -> None:
        """Tell that no other site finds room, where that is so."""
        if self._knows_senders and len(self.connected_to()) >= MOST_SESSIONS:
            self._refusals.add(
                f"{MOST_SESSIONS} connections are open, and further ones are refused: two of each site over QUIC"
            )

    def _is_connected(self) -> bool:
        return all(session.locators() for session in {self._session, self._streams})

    def _data(self, item: zenoh.Query | zenoh.Sample) -> bytes:
        """Return the bytes of an item, with the sender's name where its certificate tells it."""
        data = item.payload.to_bytes() if item.payload else b""
        return Signed(data, site_in(item)) if self._knows_senders else data

    def _put(self, channel: Channel, data: bytes, reliably: bool, attachment: bytes | None) -> None:
        """Put a message now. Called by the thread of its urgency alone, as it may wait for the network."""
        blocks = channel.must_arrive and (reliably or channel.urgency is Urgency.STOP)
        self._put_on(channel, channel.of(self._site), data, reliably, blocks, attachment)

    def _put_on(
        self, channel: Channel, key: str, data: bytes, reliably: bool, blocks: bool, attachment: bytes | None
    ) -> None:
        control, reliability = zenoh.CongestionControl, zenoh.Reliability
        session = self._streams if channel.is_streamed else self._session
        publisher = session.publisher(
            (key, reliably),
            lambda session: session.declare_publisher(
                key,
                priority=getattr(zenoh.Priority, channel.urgency.value),
                congestion_control=control.BLOCK if blocks else control.DROP,
                express=not channel.is_large,
                reliability=reliability.RELIABLE if reliably else reliability.BEST_EFFORT,
            ),
        )
        publisher.put(data, attachment=attachment)

    def _by_datagram(self, channel: Channel, key: str, question_id: bytes) -> Callable[[bytes], None]:
        """Return a function that answers a copy by a datagram."""
        outbox = self._outboxes[channel.urgency]
        return lambda data: outbox.submit(
            lambda: self._put_on(channel, key, data, reliably=False, blocks=False, attachment=question_id)
        )

    def _on_reply(self, question: Question) -> Callable[[zenoh.Reply], None]:
        def hear(reply: zenoh.Reply) -> None:
            if reply.ok is not None and self._quic is not None:
                self._quic.heard()  # an error comes from this side, if the other one is not connected
            question.on_reply(reply)

        return hear

    def _set_limit(self, channel: Channel, bytes_per_s: float, which: int = 1) -> None:
        """Set a channel's budget for the link as configured (0) or as found (1); the smaller one counts."""
        with self._lock:
            limits = list(self._limits.get(channel, (0.0, 0.0)))
            limits[which] = bytes_per_s
            self._limits[channel] = (limits[0], limits[1])
        self._outboxes[channel.urgency].limit(channel.key, min(filter(None, limits), default=0.0))

    def _taker(self, channel: Channel, take: Callable[[Any], bool | None]) -> Any:
        """Return what takes each item of a channel in the thread that reads its connection."""
        heard = self._quic.heard if self._quic is not None else lambda: None
        return in_reader(self._refusals.guarded(channel, take, heard))
