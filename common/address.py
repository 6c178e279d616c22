"""Network addresses as people write them: host:port, with an IPv6 host in brackets.

The only parser of them.
"""

from __future__ import annotations

import errno
import ipaddress
import os
import socket

from farhand.common.errors import InvalidConfiguration, LinkError, PortTaken

Address = tuple[str, int]
"""Host and port."""

EXAMPLE = "HOST:PORT, such as 127.0.0.1:7448 or [::1]:7448"

_KINDS = {
    "tcp": socket.SOCK_STREAM,
    "tls": socket.SOCK_STREAM,
    "ws": socket.SOCK_STREAM,
    "quic": socket.SOCK_DGRAM,
    "udp": socket.SOCK_DGRAM,
}
"""Schemes of the transport's endpoints, with the type of their sockets."""


def parse_address(text: str, field: str, source: str = "command line") -> Address:
    """Return host and port of an address.

    Args:
        text: HOST:PORT; an IPv6 host is in brackets.
        field: Name of the field, for the error.
        source: Origin of the field, for the error.

    Raises:
        InvalidConfiguration: When it has another form; names the field.
    """
    found = split_address(text)
    if found is None or found[1] is None or not _is_plain(found[0]):
        raise InvalidConfiguration(source, field, f"{EXAMPLE}, with a port up to 65535, got {text!r}")
    return found[0], found[1]


def split_address(text: str) -> tuple[str, int | None] | None:
    """Return the host, without brackets, and the port of an address, None where it has none; None for anything else.

    Args:
        text: HOST or HOST:PORT; an IPv6 host is in brackets.
    """
    host, colon, port = text.rpartition(":")
    if not colon or text.endswith("]"):
        host, port = text, "0"
    bracketed = host.startswith("[") and host.endswith("]")
    if bracketed:
        host = host[1:-1]
    well_formed = host and port.isascii() and port.isdigit() and len(port) <= 5 and int(port) <= 65535
    if not well_formed or bracketed is not (":" in host):
        return None
    return host, int(port) if colon and not text.endswith("]") else None


def show_address(address: Address) -> str:
    """Return an address as `parse_address` reads it."""
    host, port = address
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def endpoint_fault(endpoint: str) -> str:
    """Return the reason why a text is not an endpoint of the transport; empty when it is one.

    Args:
        endpoint: SCHEME/HOST:PORT, optionally with the transport's own options after `?` or `#`.
    """
    scheme, slash, rest = endpoint.partition("/")
    expected = f"{'/, '.join(_KINDS)}/ and HOST:PORT, such as tcp/127.0.0.1:7447 or tcp/[::1]:7447"
    if not slash or scheme not in _KINDS:
        return f"{expected}, got {endpoint!r}"
    try:
        parse_address(_without_options(rest), "")
    except InvalidConfiguration:
        return f"{expected}, with a port up to 65535, got {endpoint!r}"
    return ""


def endpoint_address(endpoint: str) -> Address:
    """Return host and port of a well-formed endpoint of the transport."""
    return parse_address(_without_options(endpoint.partition("/")[2]), "listen")


def is_loopback(host: str) -> bool:
    """Decide whether a host can only be this machine itself; of names, localhost alone."""
    if host == "localhost":
        return True
    try:
        found = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return False
    return (getattr(found, "ipv4_mapped", None) or found).is_loopback


def bind(
    address: Address,
    receive_buffer_bytes: int = 0,
    kind: int = socket.SOCK_STREAM,
    other_port: str = "choose another port",
) -> socket.socket:
    """Return a non-blocking socket that is bound, and listens if it is a stream socket.

    Args:
        address: Host and port; port 0 takes a free one. `::` takes every address, of IPv4 too where that can be.
        receive_buffer_bytes: Size of the kernel's buffer of each connection; 0 leaves it to the kernel.
        kind: `SOCK_STREAM` or `SOCK_DGRAM`.
        other_port: How another port is chosen, for the error.

    Raises:
        LinkError: When the port is in use, not allowed or out of range, or the address does not belong to
            this machine; says which, and the remedy.
    """
    host, port = address
    if not 0 <= port <= 65535:
        raise LinkError(f"cannot listen on {host} port {port}: choose a port up to 65535")
    sock: socket.socket | None = None
    try:
        found = socket.getaddrinfo(host, port, type=kind, flags=socket.AI_PASSIVE)
        family, kind, _, _, resolved = min(
            found, key=lambda each: each[0]
        )  # IPv4 first, where a name has both
        sock = socket.socket(family, kind)
        if os.name == "posix" and kind == socket.SOCK_STREAM:  # otherwise two processes could share the port
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6 and socket.has_dualstack_ipv6():
            sock.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, host != "::")
        if receive_buffer_bytes:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer_bytes)
        sock.bind(resolved)
        if kind == socket.SOCK_STREAM:
            sock.listen()
        sock.setblocking(False)
    except (OSError, UnicodeError) as error:  # a host name with odd characters fails in its encoding
        if sock:
            sock.close()
        taken = isinstance(error, OSError) and error.errno == errno.EADDRINUSE
        raise (PortTaken if taken else LinkError)(_explain(host, port, error, other_port)) from error
    return sock


def free_port(scheme: str = "tcp") -> int:
    """Return a port of this machine's loopback that is free for a scheme of the transport.

    Raises:
        LinkError: When the machine has no such loopback; says so, with the remedy.
    """
    while True:
        with bind(("127.0.0.1", 0), kind=_KINDS[scheme]) as probe:
            port = probe.getsockname()[1]
        if not listening_fault(f"{scheme}/127.0.0.1:{port}"):
            return port


def listening_fault(endpoint: str) -> str:
    """Return the reason why an endpoint cannot be listened on now; empty when it can.

    Args:
        endpoint: Well-formed endpoint of the transport. Where QUIC listens, TLS does too, at the same port.
    """
    scheme = endpoint.partition("/")[0]
    try:
        for kind in {_KINDS[scheme], socket.SOCK_STREAM} if scheme == "quic" else {_KINDS[scheme]}:
            bind(endpoint_address(endpoint), kind=kind).close()
    except LinkError as error:
        return str(error)
    return ""


def _explain(host: str, port: int, error: OSError | UnicodeError, other_port: str) -> str:
    """Say which of the reasons it is for which a port cannot be had, and what helps."""
    if isinstance(error, socket.gaierror | UnicodeError):
        return (
            f"cannot listen on {host} port {port}: no such host ({error}); choose an address of this machine"
        )
    where = f"cannot listen on {host} port {port}"
    match error.errno:
        case errno.EADDRINUSE:
            return f"port {port} on {host} is in use: end the process that holds it, or {other_port}"
        case errno.EADDRNOTAVAIL | errno.EAFNOSUPPORT:
            of, other = ("IPv6", "127.0.0.1") if ":" in host else ("IPv4", "::1")
            return (
                f"{where}: no interface of this machine has this {of} address now; choose an address of this machine,"
                f" such as {other}"
            )
        case errno.EACCES | errno.EPERM:
            return f"{where}: this user may not ({error.strerror}); {other_port}, above 1023"
    return f"{where}: {error.strerror or error}; choose an address of this machine and a free port"


def _without_options(rest: str) -> str:
    return rest.partition("#")[0].partition("?")[0]


def _is_plain(host: str) -> bool:
    return host.isprintable() and not any(character.isspace() or character in "[]/@?#" for character in host)
