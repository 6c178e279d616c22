"""Hosts as browsers and headers write them, and the socket that the page listens at."""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import re
import socket
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from farhand.common.errors import LinkError, PortTaken

EVERY_ADDRESS = ("0.0.0.0", "::")
_DEFAULT_PORTS = {"http": 80, "https": 443}
_HOST = re.compile(r"[a-z0-9._-]{1,253}|[0-9a-f:.%]{2,60}")
_OTHER_PORT_HELPS = (errno.EADDRINUSE, errno.EACCES)


class PageUnavailable(LinkError):
    """The page cannot be served at its address."""


@dataclass(frozen=True)
class Name:
    """A host as an address bar or a header gives it.

    Args:
        host: In lower case, without brackets and without a final dot.
        port: The port; None when none is given.
        scheme: `http`, `https` or empty.
    """

    host: str
    port: int | None = None
    scheme: str = ""

    @classmethod
    def of(cls, text: str) -> Name | None:
        """Return the host of `HOST`, `HOST:PORT`, `[IPv6]:PORT` or an origin; None for anything else."""
        try:
            parts = urlsplit(text if "//" in text else f"//{text}")
            host, port = parts.hostname, parts.port
        except ValueError:
            return None
        more = parts.path or parts.query or parts.fragment or parts.username is not None
        if more or not _HOST.fullmatch(host or "") or parts.scheme not in ("", *_DEFAULT_PORTS):
            return None
        return cls((host or "").rstrip("."), port, parts.scheme)

    @property
    def is_loopback(self) -> bool:
        """Whether it can only mean the machine that the browser runs on."""
        return self.host == "localhost" or is_loopback(self.host)

    @property
    def in_url(self) -> str:
        """The host as a URL has it."""
        return f"[{self.host}]" if ":" in self.host else self.host

    def same_origin(self, other: Name) -> bool:
        """Decide whether both are one origin. `Host` has no scheme: its missing port is any default one."""
        return self.host == other.host and not self._ports.isdisjoint(other._ports)

    @property
    def _ports(self) -> set[int]:
        if self.port is not None:
            return {self.port}
        return {_DEFAULT_PORTS[self.scheme]} if self.scheme else set(_DEFAULT_PORTS.values())


def default_gateway() -> str:
    """Return the address of the gateway that leads out of this machine or container; empty without one."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/net/route").read_text("ascii").splitlines()[1:]:
            _, destination, gateway, *_ = line.split()
            if int(destination, 16) == 0:
                return str(ipaddress.IPv4Address(int(gateway, 16).to_bytes(4, "little")))
    return ""


def is_loopback(address: str) -> bool:
    """Decide whether an IP address is this machine's own; a host name is not an address."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return False
    return (getattr(found, "ipv4_mapped", None) or found).is_loopback


def listening(host: str, port: int) -> socket.socket:
    """Return a socket that listens; port 0 takes a free one.

    Raises:
        PortTaken: When another process has the port.
        PageUnavailable: When the address cannot be had for another reason.
    """
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        family, *_, address = min(found, key=lambda each: each[0])  # IPv4 first, where a name has both
        both = host == "::" and socket.has_dualstack_ipv6()
        return socket.create_server(address[:2], family=family, dualstack_ipv6=both)
    except (OSError, UnicodeError) as error:
        number = None if isinstance(error, socket.gaierror) else getattr(error, "errno", None)
        remedy = "choose another port with --port" if number in _OTHER_PORT_HELPS else "check page_host"
        reason = getattr(error, "strerror", None) or error
        kind = PortTaken if number == errno.EADDRINUSE else PageUnavailable
        raise kind(f"the page cannot be served at {host} port {port} ({reason}): {remedy}") from error


def reachable_address(host: str) -> str:
    """Return an address of this machine that others may reach, where the page is served at all of them."""
    if host not in EVERY_ADDRESS:
        return host
    family, far = (socket.AF_INET6, "2001:db8::1") if ":" in host else (socket.AF_INET, "192.0.2.1")
    with contextlib.suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as probe:
        probe.connect((far, 9))  # sends nothing
        return str(probe.getsockname()[0])
    return socket.gethostname()
