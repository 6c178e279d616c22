"""Sessions of one site: one; over QUIC a site that connects has two more, for its streams and for stops."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import zenoh

from farhand.common.errors import LinkError
from farhand.common.link.endpoint import EndpointSettings, scheme_of
from farhand.common.link.session import RETRY_S, Configure, Declare, Session
from farhand.common.wire import keys
from farhand.common.wire.keys import Channel, Urgency


class SiteSessions:
    """Sessions of one site, which are opened and closed together.

    Args:
        settings: The endpoints.

    Raises:
        LinkError: When the endpoint cannot be listened on or is not understood.
    """

    def __init__(self, settings: EndpointSettings):
        self.main = self._streams = self._stops = Session(settings)
        """Session of all but streams and stops."""
        if settings.connect and scheme_of(settings.connect) == "quic":
            # A window of its own for streams, which fill it, and for stops, which must not wait for room in one.
            self._streams, self._stops = Session(settings), Session(settings)
        self._all = tuple({self._streams: None, self._stops: None, self.main: None})
        """The streams' first: the other end accepts one after the other, and fresh data must come soon."""

    def declare(self, channel: Channel, declare: Declare) -> None:
        """Make a declaration on the sessions on which a channel's messages arrive, and on each later one."""
        for session in dict.fromkeys(self._of(channel, reliably) for reliably in (False, True)):
            session.declare(declare)

    def put(
        self, channel: Channel, key: str, data: bytes, reliably: bool, blocks: bool, attachment: bytes | None
    ) -> None:
        """Put a message now, in the thread of its urgency alone, as it may wait for the network.

        Args:
            channel: Channel of the message.
            key: Key of the message.
            data: Bytes of the message.
            reliably: Have the transport resend what was lost.
            blocks: Wait for room in a full queue.
            attachment: Bytes beside the message.
        """
        control, reliability = zenoh.CongestionControl, zenoh.Reliability
        publisher = self._of(channel, reliably).publisher(
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

    @property
    def is_connected(self) -> bool:
        """True if every session has a connection."""
        return all(session.locators() for session in self._all)

    def answers(self, key: str, timeout_s: float, gives_up: Callable[[], bool]) -> bool:
        """Decide whether a question is answered in time over every connection, see `Session.answers`."""
        return all(session.answers(key, timeout_s, gives_up) for session in self._all)

    def reopen(self) -> None:
        """Open all sessions again in place."""
        self._each(self._all, Session.reopen)

    def reconnect(self) -> None:
        """Open the sessions without a connection again, all of them if each has one."""
        self._each([each for each in self._all if not each.locators()] or self._all, Session.reopen)

    def renew(self, key: str, timeout_s: float, gives_up: Callable[[], bool]) -> None:
        """Replace all sessions by fresh ones that answer a question, without a gap, see `Session.renew`."""
        self._each(self._all, lambda session: session.renew(key, timeout_s, gives_up))

    def _each(self, sessions: Sequence[Session], do: Callable[[Session], None]) -> None:
        """Do something with sessions at the same time: a handshake takes several round trips."""
        with ThreadPoolExecutor(len(sessions)) as pool:
            list(pool.map(do, sessions))

    def close(self) -> None:
        """Close all sessions."""
        for session in self._all:
            session.close()

    def _of(self, channel: Channel, reliably: bool) -> Session:
        """Return the session of a message. A stop's reliable copy takes another way than its datagrams: one may be dead."""
        if channel is keys.TELEMETRY_BY_STOPS or (channel.urgency is Urgency.STOP and not reliably):
            return self._stops
        if channel is keys.TELEMETRY_BY_MAIN:
            return self.main
        return self._streams if channel.is_streamed else self.main


def try_session(
    settings: EndpointSettings, configure: Configure, key: str, timeout_s: float, ended: threading.Event
) -> float | None:
    """Open a session for one question alone; return the time until the answer [s], None without one.

    Args:
        settings: The endpoints.
        configure: Returns the transport's configuration.
        key: Key of the question.
        timeout_s: Time limit of the answer [s].
        ended: Ends the attempt early.
    """
    began_s = time.monotonic()
    try:
        session = Session(settings, configure)
    except LinkError:  # such as certificates that are being replaced
        ended.wait(RETRY_S)
        return None
    try:
        return time.monotonic() - began_s if session.answers(key, timeout_s, ended.is_set) else None
    finally:
        session.close()
