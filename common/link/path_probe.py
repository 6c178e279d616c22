"""Probe of the path to the other end, so that a new connection begins as soon as possible.

After half a minute of silence QUIC gives up its connection. An attempt to connect that began during an outage has doubled
its pauses, and loses seconds after the path's return. A packet of an unknown version is a cheap probe: every QUIC server
answers it with its versions (RFC 9000, section 6). An open path on which a question stays without an answer belongs to a
connection whose other end was restarted: QUIC itself would notice that after half a minute.
"""

from __future__ import annotations

import contextlib
import secrets
import socket
import threading
import time
from collections.abc import Callable

from farhand.common.address import endpoint_address

_DOUBTED_S, _ASKED_EVERY_S = 1.5, 2.0
"""Silence after which the other end is asked whether it is still there, and time between two such questions [s]."""
_ANSWER_S, _ANSWER_ROUND_TRIPS = 0.5, 2.0
"""Time limit of its answer on an open path: a constant [s] plus a number of round trips."""
_SURVIVED_S = 1.0
"""Wait for the next message once the path is open after an outage: three a second are sent meanwhile [s]."""
_UNCONNECTED_S = 3.0
"""Time without a connection after which the path is probed for another attempt [s]."""
_EVERY_S, _LOOK_S = 0.4, 0.1
_ATTEMPT_S, _ATTEMPT_ROUND_TRIPS = 1.5, 7.0
"""Time limit of a new connection before the next attempt: a constant [s] plus a number of round trips."""
_PROBE_BYTES = 1200
"""Size of the smallest packet that a server answers [B]."""
_LONG_HEADER, _RESERVED_VERSION, _ID_BYTES = b"\xc0", b"\x1a\x2a\x3a\x4a", 8


class PathProbe:
    """Prober of the path, in a thread of its own.

    Args:
        endpoint: QUIC endpoint of the other end.
        silent_s: Returns the silence of the other end [s].
        is_connected: Returns True if the transport has a connection.
        answers: Decides whether the other end answers on the present connection within a time [s].
        reconnect: Begins a new connection; may block for a moment.
    """

    def __init__(
        self,
        endpoint: str,
        silent_s: Callable[[], float],
        is_connected: Callable[[], bool],
        answers: Callable[[float], bool],
        reconnect: Callable[[], None],
    ):
        self._address = endpoint_address(endpoint)
        self._silent_s, self._is_connected = silent_s, is_connected
        self._answers, self._reconnect = answers, reconnect
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="path probe", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        was_connected, connected_s = False, time.monotonic()
        while not self._closed.wait(_LOOK_S):
            if self._is_connected():
                was_connected, connected_s = True, time.monotonic()
                if self._silent_s() >= _DOUBTED_S:
                    self._doubt()
            elif was_connected or time.monotonic() - connected_s >= _UNCONNECTED_S:
                self._restore()

    @property
    def _is_well(self) -> bool:
        return self._closed.is_set() or self._is_connected()

    def _doubt(self) -> None:
        """Ask the other end, and reconnect if the path is open but a connection carries no answer.

        A connection that had outages before has a small window, which is soon full in the next one: it then sends its
        next packet only after a pause that has doubled each time. A new connection is quicker.
        """
        if self._answers(_ANSWER_S):
            self._closed.wait(_ASKED_EVERY_S)
            return
        was_cut = False
        while self._is_silent:
            if (round_trip_s := probe(self._address, _EVERY_S, self._closed)) is None:
                was_cut = True  # nothing is asked meanwhile: it would fill the window
                continue
            survived = self._is_heard_within(_SURVIVED_S) if was_cut else self._answers(
                _ANSWER_S + _ANSWER_ROUND_TRIPS * round_trip_s
            )  # fmt: skip
            if not survived and not self._closed.is_set():
                self._reconnect()
                self._wait(_ATTEMPT_S + _ATTEMPT_ROUND_TRIPS * round_trip_s)
            return

    @property
    def _is_silent(self) -> bool:
        return self._silent_s() >= _DOUBTED_S and not self._closed.is_set()

    def _is_heard_within(self, patience_s: float) -> bool:
        """Wait for a message over every connection; return False if none came."""
        give_up_s = time.monotonic() + patience_s
        while self._is_silent and time.monotonic() < give_up_s:
            self._closed.wait(_LOOK_S)
        return not self._is_silent

    def _restore(self) -> None:
        """Probe until the path is open, then reconnect until there is a connection."""
        while not self._is_well:
            round_trip_s = probe(self._address, _EVERY_S, self._closed)
            if round_trip_s is not None and not self._is_well:
                self._reconnect()
                self._wait(_ATTEMPT_S + _ATTEMPT_ROUND_TRIPS * round_trip_s)

    def _wait(self, patience_s: float) -> None:
        give_up_s = time.monotonic() + patience_s
        while not self._is_well and time.monotonic() < give_up_s:
            self._closed.wait(_LOOK_S)


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
