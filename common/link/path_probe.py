"""Probe of the path to the other end, so that a new connection begins as soon as possible.

After half a minute of silence QUIC gives up its connection. An attempt to connect that began during an outage has doubled
its pauses, and loses seconds after the path's return. A packet of an unknown version is a cheap probe: every QUIC server
answers it with its versions (RFC 9000, section 6). An open path on which a question stays without an answer belongs to a
connection whose other end was restarted: QUIC itself would notice that after half a minute.

A TCP connection of which a NAT or a firewall has forgotten the state is silent until the transport's lease ends, two
minutes later. Only another connection tells this from an outage, which the old one survives: whichever brings the
first answer is kept.
"""

from __future__ import annotations

import contextlib
import math
import secrets
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from farhand.common.address import endpoint_address
from farhand.common.link.budget import Silence
from farhand.common.link.endpoint import EndpointSettings, scheme_of
from farhand.common.link.session import Configure
from farhand.common.link.site_sessions import try_session

_ANSWER_S, _ANSWER_ROUND_TRIPS = 0.5, 1.0
"""Time limit of its answer on an open path: a constant [s] plus a number of round trips."""
_UNCONNECTED_S = 3.0
"""Time without a connection after which the path is probed for another attempt [s]."""
_EVERY_S, _LOOK_S = 0.4, 0.1
_CHECK_S, _CHECK_ANSWER_S = 10.0, 15.0
"""Pause between checks of connections that are idle, such as that of stops, which a NAT forgets after half a minute, and the time
limit of their answers, even over the longest path [s]."""
_ATTEMPT_S, _ATTEMPT_ROUND_TRIPS = 1.5, 7.0
"""Time limit of a new connection before the next attempt: a constant [s] plus a number of round trips."""
_MORE_PATIENCE, _MOST_PATIENCE = 1.5, 4.0
"""Factor from one attempt to the next, as a path that loses much needs longer for a handshake, and its limit."""
_PROBE_BYTES = 1200
"""Size of the smallest packet that a server answers [B]."""
_LONG_HEADER, _RESERVED_VERSION, _ID_BYTES = b"\xc0", b"\x1a\x2a\x3a\x4a", 8
_TCP_PATIENCE, _TRIAL = 2.0, 20.0
"""Patience over TCP in comparison with QUIC, since TCP resends what was lost, and time limit of a trial in usual silences."""
_OPENING_ROUND_TRIPS = 4.0
"""Round trips until a new session has its first answer."""


@dataclass(frozen=True)
class Path:
    """Path to the other end as its transport tests it, with the patience that the transport needs.

    Args:
        probe: Returns the round trip of an open path [s], None without an answer in its time; the event ends it early.
        doubted_s: Silence after which the other end is asked whether it is still there [s].
        answer_s: Time for the first answer, before the path is probed [s].
        lost_s: Time without a connection after which the path is probed, when there was one before [s].
        unconnected_s: The same when there was none [s].
        checked_s: Pause between checks of all connections while the other end is heard [s]; infinite for a single one.
    """

    probe: Callable[[threading.Event], float | None]
    doubted_s: float
    answer_s: float
    lost_s: float
    unconnected_s: float
    checked_s: float = math.inf

    @classmethod
    def of(cls, settings: EndpointSettings, configure: Configure, key: str, silence: Silence) -> Path:
        """Return the path of a site that connects.

        Args:
            settings: Endpoint to connect to.
            configure: Returns the transport's configuration.
            key: Key of a question that the other end answers to everybody.
            silence: Silence of the other end.
        """
        if scheme_of(settings.connect) == "quic":
            address = endpoint_address(settings.connect)
            return cls(
                lambda ended: probe(address, _EVERY_S, ended), silence.doubted_s, silence.usual_s,
                lost_s=0.0, unconnected_s=_UNCONNECTED_S, checked_s=_CHECK_S,
            )  # fmt: skip

        def probe_by_session(ended: threading.Event) -> float | None:
            took_s = try_session(settings, configure, key, _TRIAL * silence.usual_s, ended)
            return took_s / _OPENING_ROUND_TRIPS if took_s is not None else None

        # The transport itself tries to connect all the time, and a slow handshake must not be begun again in vain.
        unconnected_s = _TRIAL * silence.usual_s
        return cls(
            probe_by_session, _TCP_PATIENCE * silence.doubted_s, _TCP_PATIENCE * 2.0 * silence.usual_s,
            lost_s=unconnected_s, unconnected_s=unconnected_s,
        )  # fmt: skip


class PathProbe:
    """Prober of the path, in a thread of its own.

    Args:
        path: Path to the other end.
        silent_s: Returns the silence of the other end [s].
        is_connected: Returns True if the transport has a connection.
        answers: Decides whether the other end answers on the present connection within a time [s], unless the function says
            that it gives up.
        reconnect: Begins a new connection; may block for a moment.
        renew: Opens a connection beside the present one and changes over if that is answered within a time [s], unless
            the function says that it gives up. None where there can be only one.
    """

    def __init__(
        self,
        path: Path,
        silent_s: Callable[[], float],
        is_connected: Callable[[], bool],
        answers: Callable[[float, Callable[[], bool]], bool],
        reconnect: Callable[[], None],
        renew: Callable[[float, Callable[[], bool]], None] | None = None,
    ):
        self._path, self._silent_s, self._is_connected = path, silent_s, is_connected
        self._answers, self._reconnect, self._renew = answers, reconnect, renew
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="path probe", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        was_connected, connected_s = False, time.monotonic()
        attempted_s = checked_s = connected_s
        while not self._closed.wait(_LOOK_S):
            if self._is_connected():
                was_connected, connected_s, attempted_s = True, time.monotonic(), -math.inf
                if self._is_silent:
                    self._doubt()
                elif connected_s - checked_s >= self._path.checked_s:
                    self._check()
                    checked_s = time.monotonic()
                continue
            patience_s = self._path.lost_s if was_connected else self._path.unconnected_s
            if time.monotonic() - connected_s >= patience_s:
                self._restore(attempted_s)

    @property
    def _is_well(self) -> bool:
        return self._closed.is_set() or self._is_connected()

    def _doubt(self) -> None:
        """Ask the other end; without an answer open another connection as soon as the path is open.

        That is done although the present one may survive: it then has a small window, which the next outage would
        soon fill, and would send its next packet only after a pause that has doubled each time.
        """
        if self._answers(self._path.answer_s, self._closed.is_set):
            self._closed.wait(self._path.doubted_s)
            return
        round_trip_s = None
        while round_trip_s is None and self._is_silent:
            # Nothing is asked until the path is open: it would fill the window.
            round_trip_s = self._path.probe(self._closed)
        if self._closed.is_set():
            return
        survives = self._renew is None and (
            round_trip_s is None
            or self._answers(_ANSWER_S + _ANSWER_ROUND_TRIPS * round_trip_s, self._closed.is_set)
            or not self._is_silent
        )
        if not survives:
            self._replace(round_trip_s or 0.0)

    def _check(self) -> None:
        """Ask over each connection, and replace them if one of them is dead although the other end is heard."""
        if self._answers(_CHECK_ANSWER_S, lambda: self._closed.is_set() or self._is_silent):
            return
        round_trip_s = self._path.probe(self._closed)
        if round_trip_s is not None and not self._closed.is_set() and not self._is_silent:
            self._replace(round_trip_s)

    def _replace(self, round_trip_s: float) -> None:
        attempt_s = _attempt_s(round_trip_s)
        if self._renew is not None:
            self._renew(attempt_s, self._until_silent_again())
        else:
            self._reconnect()
            self._wait(attempt_s)

    def _until_silent_again(self) -> Callable[[], bool]:
        """Return what ends an attempt: the other end was heard, and then no more."""
        heard = False

        def gives_up() -> bool:
            nonlocal heard
            heard = heard or not self._is_silent
            return self._closed.is_set() or (heard and self._is_silent)

        return gives_up

    @property
    def _is_silent(self) -> bool:
        return self._silent_s() >= self._path.doubted_s and not self._closed.is_set()

    def _restore(self, attempted_s: float) -> None:
        """Probe until the path is open, then reconnect until there is a connection.

        Args:
            attempted_s: Start of the first attempt, which may still succeed over a long path [s].
        """
        patience = 1.0
        while not self._is_well:
            if (round_trip_s := self._path.probe(self._closed)) is None:
                continue
            self._wait(attempted_s + patience * _attempt_s(round_trip_s) - time.monotonic())
            if not self._is_well:
                attempted_s, patience = time.monotonic(), min(_MOST_PATIENCE, _MORE_PATIENCE * patience)
                self._reconnect()

    def _wait(self, patience_s: float) -> None:
        give_up_s = time.monotonic() + patience_s
        while not self._is_well and time.monotonic() < give_up_s:
            self._closed.wait(_LOOK_S)


def _attempt_s(round_trip_s: float) -> float:
    return _ATTEMPT_S + _ATTEMPT_ROUND_TRIPS * round_trip_s


def probe(
    address: tuple[str, int], every_s: float, ended: threading.Event, patience_s: float = 5.0
) -> float | None:
    """Return the round trip to a QUIC server [s]; None without an answer.

    Args:
        address: Host and port of the server.
        every_s: Time between two packets [s]; an answer to any of them is accepted.
        ended: Ends the attempt early.
        patience_s: Time to wait for an answer [s].
    """
    sent_s: dict[bytes, float] = {}
    with contextlib.suppress(OSError), _connected(address) as sock:
        give_up_s = time.monotonic() + patience_s
        while (now_s := time.monotonic()) < give_up_s and not ended.is_set():
            mine = secrets.token_bytes(_ID_BYTES)
            sent_s[mine] = now_s
            with contextlib.suppress(OSError):  # nobody listens there yet
                sock.send(_packet(mine))
            if (answered := _answered(sock, every_s, ended)) in sent_s:
                return time.monotonic() - sent_s[answered]
    return None


def _connected(address: tuple[str, int]) -> socket.socket:
    host, port = address
    family, kind, protocol, _, resolved = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    sock = socket.socket(family, kind, protocol)
    sock.connect(resolved)
    return sock


def _packet(mine: bytes) -> bytes:
    theirs = secrets.token_bytes(_ID_BYTES)
    size = bytes([_ID_BYTES])
    return (_LONG_HEADER + _RESERVED_VERSION + size + theirs + size + mine).ljust(_PROBE_BYTES, b"\0")


def _answered(sock: socket.socket, wait_s: float, ended: threading.Event) -> bytes:
    """Return the id of the first packet answered within a time; empty if none is."""
    until_s = time.monotonic() + wait_s
    while (left_s := until_s - time.monotonic()) > 0:
        sock.settimeout(left_s)
        try:
            data = sock.recv(2048)
        except TimeoutError:
            return b""
        except OSError:  # refused at once: keep the pause between packets
            ended.wait(max(0.0, until_s - time.monotonic()))
            return b""
        if data[1:5] == bytes(4) and data[5:6] == bytes([_ID_BYTES]):
            return data[6 : 6 + _ID_BYTES]
    return b""
