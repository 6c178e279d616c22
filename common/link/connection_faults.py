"""Failing connections: those whose peer does not read are ended, and the reason of a refused encryption is found.

The transport closes its side of such a connection only when the last write succeeds, which it never does:
until then a descriptor and megabytes of the kernel's buffers stay with it. Linux lists what waits where;
elsewhere nothing is found, and the connection ends when its other end does.
"""

from __future__ import annotations

import contextlib
import ipaddress
import os
import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from farhand.common.address import Address, endpoint_address, parse_address, show_address
from farhand.common.link.certificates import CA_FILE, CERTIFICATE_FILE, KEY_FILE, SiteCertificate
from farhand.common.link.endpoint import EndpointSettings

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


_PATIENCE_S = 3.0

_OF_ROBOT = {
    62: "the robot's certificate is not for {host}: dial a name that it has, or make it with --san {host}",
    64: "the robot's certificate is not for {host}: dial a name that it has, or make it with --san {host}",
    10: "the robot's certificate has expired, or the clock of this machine is wrong: farhand pki renew",
    9: "the robot's certificate is not valid yet: is the clock of this machine right?",
    26: "what answers at {where} shows the certificate of an operator, not of a robot",
    79: "what answers at {where} shows the certificate of an operator, not of a robot",
    18: "another authority has issued the robot's certificate",
    19: "another authority has issued the robot's certificate",
    20: "another authority has issued the robot's certificate",
    7: "another authority has issued the robot's certificate",
}
"""Reasons by OpenSSL's error numbers for the robot's certificate."""
_OF_SITE = {
    "UNKNOWN_CA": "another authority has issued this site's certificate than the robot trusts",
    "DECRYPT_ERROR": "another authority has issued this site's certificate than the robot trusts",
    "CERTIFICATE_EXPIRED": "the robot takes this site's certificate for expired: farhand pki renew, or its clock is wrong",
    "BAD_CERTIFICATE": "the robot does not accept this site's certificate",
    "CERTIFICATE_REQUIRED": "the robot asks for a certificate, and this site shows none",
}
"""Reasons by the TLS alert of the robot, for this site's certificate."""


_ACCEPTED = (
    "the robot accepts this site's certificate, but no connection is open: if this lasts, UDP may be blocked on the way "
    "(--connect tls/...), or as many sites are connected as the robot takes"
)


def explain_silence(settings: EndpointSettings, connected: bool) -> str:
    """Return the probable reason of the robot's silence over an encrypted link; empty if none is found.

    Args:
        settings: Settings of the site that connects.
        connected: True if the transport is connected to the robot.
    """
    if not settings.certificates:
        return "" if connected else _encrypted_there(settings.connect)
    if connected:
        name = SiteCertificate.load(settings.certificate_folder).name
        return f"the robot lets {name} in and tells it nothing: does its list of sites name {name}, and not as revoked?"
    return find_refusal(settings.connect, settings.certificate_folder) or _ACCEPTED


def _encrypted_there(endpoint: str) -> str:
    """Return that certificates are needed, if what answers at a plain endpoint speaks TLS; empty otherwise."""
    address = endpoint_address(endpoint)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)  # nothing is sent, so it does not matter who answers
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    try:
        with socket.create_connection(address, _PATIENCE_S) as plain, context.wrap_socket(plain):
            pass
    except OSError:  # it does not, or nobody answers
        return ""
    where = show_address(address)
    return f"the robot at {where} requests a certificate: --connect quic/{where} --certificates FOLDER (farhand pki operator)"


def find_refusal(endpoint: str, folder: Path) -> str:
    """Try once to open an encrypted connection, and return the reason of its refusal; empty if it is accepted.

    The robot answers TLS over TCP at the same port as QUIC, with the same certificate.

    Args:
        endpoint: Endpoint of the robot or of the link process.
        folder: Folder of this site's certificate.
    """
    host, port = endpoint_address(endpoint)
    where = show_address((host, port))
    try:
        context = ssl.create_default_context(cafile=str(folder / CA_FILE))
        context.minimum_version = ssl.TLSVersion.TLSv1_3
        context.load_cert_chain(folder / CERTIFICATE_FILE, folder / KEY_FILE)
        with socket.create_connection((host, port), _PATIENCE_S) as plain:
            try:
                encrypted = context.wrap_socket(plain, server_hostname=host)
            except TimeoutError:
                return f"{where} does not speak TLS: does the robot listen at a quic/ or tls/ endpoint?"
            with encrypted:
                # The robot's verdict on this site's certificate comes after the handshake.
                encrypted.recv(1)
    except ssl.SSLCertVerificationError as error:
        words = _OF_ROBOT.get(
            error.verify_code, f"the robot's certificate is not accepted: {error.verify_message}"
        )
        return words.format(host=host, where=where)
    except ssl.SSLError as error:
        alert = (error.reason or "").partition("ALERT_")[2]
        return _OF_SITE.get(alert, f"{where} does not speak TLS 1.3 as a robot does ({error.reason})")
    except ConnectionRefusedError:
        return f"nobody listens at {where}: is the remote site running, with the same kind of endpoint?"
    except ConnectionError:
        return f"{where} hung up: is the robot's site running behind it?"
    except TimeoutError:
        return ""  # accepted: the robot waits for the first word
    except OSError as error:
        return f"{where} cannot be reached: {error.strerror or error}"
    return ""
