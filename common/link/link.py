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
from functools import partial
from typing import Any

import zenoh

from farhand.common.link.access import AccessWatch
from farhand.common.link.budget import OVERHEAD_BYTES, Silence
from farhand.common.link.certificates import check_site_certificate
from farhand.common.link.connection_faults import DeafListeners
from farhand.common.link.endpoint import MOST_SESSIONS, EndpointSettings, scheme_of, zenoh_configuration
from farhand.common.link.interface import Answered, Deliver, Handle, Signed
from farhand.common.link.outbox import Outbox
from farhand.common.link.path_probe import Path, PathProbe
from farhand.common.link.questions import Once, Question, ZenohRequest, in_reader, reply_to
from farhand.common.link.quic import QuicDelivery, copy_of, site_in
from farhand.common.link.refusals import Refusals, serve_rights
from farhand.common.link.site_sessions import SiteSessions
from farhand.common.log import loop_logger
from farhand.common.wire import keys
from farhand.common.wire.keys import Channel, Urgency, answers_for

_log = loop_logger(__name__)

_WIDE_BPS = 200_000.0
"""Rate of a link from which three handshakes, 18 kB, take less than a second [bit/s]."""


class ZenohLink:
    """`Link` over one Zenoh session, or three: over QUIC, streams and stops of a site that connects have one each.

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
        self._silence = Silence(settings.rate_bps)
        self._quic: QuicDelivery | None = None
        self._sessions = SiteSessions(settings)
        self._deaf = DeafListeners(self.connected_to, settings.listen, dropped) if settings.listen else None
        held_up = self._deaf.look if self._deaf is not None else lambda: None
        self._outboxes = {urgency: Outbox(urgency.name.lower(), _log, held_up) for urgency in Urgency}
        self._limits: dict[Channel, tuple[float, float]] = {}
        self._lock = threading.Lock()
        self._closed = False
        self._access = None
        if settings.certificates:
            self._access = AccessWatch(settings.certificate_folder, settings.sites, self.reopen, self._look)
        main = self._sessions.main
        if settings.listen:
            main.declare(serve_rights(self._access, settings.vehicle, self._refusals))
        elif settings.is_of_robot:
            main.declare(lambda session: session.liveliness().declare_token(keys.ALIVE))
        if scheme_of(settings.endpoint) == "quic":
            self._quic = QuicDelivery(self._silence, self._put, self._set_limit)
            if not settings.is_of_robot:
                key, answers = answers_for(self._site, self._quic.asker), self._quic.answered
                main.declare(lambda session: session.declare_subscriber(key, in_reader(answers)))
        self._probe = self._path_probe() if settings.connect else None

    def _path_probe(self) -> PathProbe:
        asked = keys.RIGHT.of("hub" if self._settings.is_of_robot else self._site)
        path = Path.of(self._settings, zenoh_configuration, asked, self._silence)
        sessions = self._sessions

        # TCP has no window that an outage wears out; on a narrow link handshakes would delay commands; and at a hub two
        # sessions of a robot would both handle its questions.
        is_wide = not 0.0 < self._settings.rate_bps < _WIDE_BPS
        renews = self._quic is not None and is_wide and not self._settings.is_of_robot
        return PathProbe(
            path, self._silent_s, lambda: sessions.is_connected, partial(sessions.answers, asked), sessions.reconnect,
            partial(sessions.renew, asked) if renews else None,
        )  # fmt: skip

    def _silent_s(self) -> float:
        """Return the silence of the more silent connection [s]: over QUIC either of the two may be stuck alone."""
        return max(self._silence.lasts_s, self._quic.streams_silent_s if self._quic is not None else 0.0)

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
        for each in keys.REPORTS if channel is keys.TELEMETRY else (channel,):
            self._subscribe(each, deliver)

    def _subscribe(self, channel: Channel, deliver: Deliver) -> None:
        key, quic = channel.of(self._site), self._quic

        def take(sample: zenoh.Sample) -> bool | None:
            if quic is not None:
                quic.arrived(channel, sample)
            return deliver(self._data(sample))

        taker = self._taker(channel, take)
        self._sessions.declare(channel, lambda session: session.declare_subscriber(key, taker))

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
            question_id, answers = copy[0], answers_for(site_in(sample), copy[1])

            def answer(data: bytes) -> None:
                outbox.submit(lambda: self._sessions.put(channel, answers, data, False, False, question_id))

            return once.take(question_id, self._data(sample), answer)

        taker = self._taker(channel, take_query)
        self._sessions.main.declare(lambda session: session.declare_queryable(key, taker))
        if channel.both_ways and self._quic is not None:
            datagrams = self._taker(channel, take_datagram)
            self._sessions.main.declare(lambda session: session.declare_subscriber(key, datagrams))

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
                self._sessions.main.get(
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
        self._sessions.reopen()

    def close(self) -> None:
        """See `Link.close`. Without it the interpreter would hang at its exit."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        watches = (self._access, self._probe, self._deaf, self._quic)
        for part in (*watches, *self._outboxes.values(), self._sessions):
            if part is not None:
                part.close()

    def connected_to(self) -> list[str]:
        """Return the locators of the other ends that are connected."""
        return self._sessions.main.locators()

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
                f"{MOST_SESSIONS} connections are open, and further ones are refused: three of each site over QUIC"
            )

    def _data(self, item: zenoh.Query | zenoh.Sample) -> bytes:
        """Return the bytes of an item, with the sender's name where its certificate tells it."""
        data = item.payload.to_bytes() if item.payload else b""
        return Signed(data, site_in(item)) if self._knows_senders else data

    def _put(self, channel: Channel, data: bytes, reliably: bool, attachment: bytes | None) -> None:
        """Put a message now. Called by the thread of its urgency alone, as it may wait for the network."""
        blocks = channel.must_arrive and (reliably or channel.urgency is Urgency.STOP)
        self._sessions.put(channel, channel.of(self._site), data, reliably, blocks, attachment)

    def _on_reply(self, question: Question) -> Callable[[zenoh.Reply], None]:
        def hear(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._silence.heard()  # an error comes from this side, if the other one is not connected
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
        return in_reader(self._refusals.guarded(channel, take, self._silence.heard))
