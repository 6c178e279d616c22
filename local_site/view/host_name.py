"""Host names and addresses, as browsers and HTTP headers write them."""

from __future__ import annotations

import contextlib
import ipaddress
import re
import socket
from dataclasses import dataclass
from pathlib import Path

from farhand.common.address import is_loopback, split_address

EVERY_ADDRESS = ("0.0.0.0", "::")
_DEFAULT_PORTS = {"http": 80, "https": 443}
_HOST = re.compile(r"[a-z0-9._-]{1,253}|[0-9a-f:.%]{2,60}")


@dataclass(frozen=True)
class Name:
    """Host as written in an address bar or a header.

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
        scheme, there_is_one, rest = text.rpartition("://")
        found = split_address(rest)
        if found is None or scheme.lower() not in (_DEFAULT_PORTS if there_is_one else ("",)):
            return None
        host, port = found[0].lower(), found[1]
        return cls(host.rstrip("."), port, scheme.lower()) if _HOST.fullmatch(host) else None

    @property
    def is_loopback(self) -> bool:
        """True if the host can only be the browser's own machine."""
        return is_loopback(self.host)

    @property
    def in_url(self) -> str:
        """Host in the form of a URL."""
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


def reachable_address(host: str) -> str:
    """Return an address of this machine that others may reach, where the page is served at all of them."""
    if host not in EVERY_ADDRESS:
        return host
    family, far = (socket.AF_INET6, "2001:db8::1") if ":" in host else (socket.AF_INET, "192.0.2.1")
    with contextlib.suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as probe:
        probe.connect((far, 9))  # sends nothing
        return str(probe.getsockname()[0])
    return socket.gethostname()
