"""Detection and end of connections that the transport has given up because their other end reads nothing.

The transport closes its side of such a connection only when the last write succeeds, which it never does:
until then a descriptor and megabytes of the kernel's buffers stay with it. Linux lists what waits where;
elsewhere nothing is found, and the connection ends when its other end does.
"""

from __future__ import annotations

import contextlib
import ipaddress
import os
import socket
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from farhand.common.address import Address, endpoint_address, parse_address, show_address

_TABLES = ("/proc/self/net/tcp", "/proc/self/net/tcp6")
_ESTABLISHED = "01"
_PAUSES_S = (0.0, 0.5, 1.0, 2.0)


@dataclass(frozen=True)
class Waiting:
    """Connection with bytes that its other end has not taken.

    Args:
        remote: Address of the other end.
        n_bytes: Waiting bytes [B].
        inode: Number of the socket, by which its descriptor is found.
    """

    remote: Address
    n_bytes: int
    inode: str


class DeafListeners:
    """Searcher for such connections whenever a message was delayed, in a thread of its own.

    Args:
        others: Returns the locators of the other ends that the transport still has.
        endpoint: Endpoint on which this site listens.
        dropped: Called with a description of each that was ended.
    """

    def __init__(self, others: Callable[[], list[str]], endpoint: str, dropped: Callable[[str], None]):
        self._others, self._port, self._dropped = others, endpoint_address(endpoint)[1], dropped
        self._held_up, self._closed = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="deaf listeners", daemon=True)
        self._thread.start()

    def look(self) -> None:
        """Start a search; never blocks."""
        self._held_up.set()

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._held_up.set()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while self._held_up.wait() and not self._closed.is_set():
            self._held_up.clear()
            for pause_s in _PAUSES_S:  # the transport gives a connection up after some time
                if self._closed.wait(pause_s):
                    return
                for words in end_deaf(self._port, addresses_of(self._others())):
                    self._dropped(f"a listener that read nothing was dropped: {words}")


def end_deaf(port: int, live: set[str]) -> list[str]:
    """End the connections to a port that hold unread bytes and that the transport no longer counts.

    Args:
        port: The local port.
        live: Addresses of the other ends that the transport still has, as `show_address` writes them.

    Returns:
        A description of each that was ended.
    """
    ended = []
    for waiting in _waiting(port):
        where = show_address(waiting.remote)
        if where not in live and _shut(waiting.inode):
            ended.append(f"{where}, {waiting.n_bytes} bytes unread")
    return ended


def _waiting(port: int) -> Iterator[Waiting]:
    for table in _TABLES:
        with contextlib.suppress(OSError):
            for line in Path(table).read_text("ascii").splitlines()[1:]:
                _, local, remote, state, queues, _, _, _, _, inode, *_ = line.split()
                n_bytes = int(queues.partition(":")[0], 16)
                if state == _ESTABLISHED and n_bytes and _address(local)[1] == port:
                    yield Waiting(_address(remote), n_bytes, inode)


def _address(text: str) -> Address:
    """Return the address in the kernel's notation: words of the host's byte order, a colon, the port."""
    host, _, port = text.partition(":")
    words = [bytes.fromhex(host[k : k + 8])[::-1] for k in range(0, len(host), 8)]
    ip = ipaddress.ip_address(b"".join(words))
    mapped = getattr(ip, "ipv4_mapped", None)
    return str(mapped or ip), int(port, 16)


def _shut(inode: str) -> bool:
    """Shut a socket of this process by its inode; its owner sees a reset connection."""
    for entry in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(OSError):
            if entry.readlink() == Path(f"socket:[{inode}]"):
                with socket.socket(fileno=os.dup(int(entry.name))) as sock:
                    sock.shutdown(socket.SHUT_RDWR)
                return True
    return False


def addresses_of(locators: list[str]) -> set[str]:
    """Return the addresses in the transport's locators, as `show_address` writes them."""
    found = set()
    for locator in locators:
        with contextlib.suppress(Exception):
            host, port = parse_address(locator.partition("/")[2], "locator")
            ip = ipaddress.ip_address(host.partition("%")[0])
            found.add(show_address((str(getattr(ip, "ipv4_mapped", None) or ip), port)))
    return found
