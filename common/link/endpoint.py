"""Endpoints of a site, and the transport's set-up for a slow link and hostile neighbours."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from farhand.common.address import endpoint_address, endpoint_fault, is_loopback
from farhand.common.clock import Wait
from farhand.common.link.access import with_access_rules
from farhand.common.link.certificates import (
    CA_FILE,
    CERTIFICATE_FILE,
    KEY_FILE,
    common_name,
    read_certificate,
)
from farhand.common.names import Name, SiteName, user_path
from farhand.common.wire.codec import MAX_BYTES

LEAST_BPS = 80.0
"""Rate of the slowest modems [bit/s]."""


SECURE = ("quic", "tls")
"""Schemes that encrypt, and request a certificate of both ends."""
_QUIC_OPTIONS = "?mixed_rel=1;multistream=1"
"""Options of QUIC: datagrams beside streams in one connection, and a stream for each priority."""
EVERY_SITE = "*"
"""Name of a robot's end in the keys of the operators' sites, since it serves all of them."""
MOST_SESSIONS = 48
"""Largest number of connections to a robot at a time, of which a site has three over QUIC."""
ROBOTS, OPERATORS = "robots", "operators"
"""Regions of the transport's network to which the two kinds of sites belong."""
_ENVELOPE_BYTES = 1024
"""Room for the key and the transport's own fields beside the largest message [B]."""


class EndpointSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Endpoints of the transport. The remote site listens, the local site connects; to a hub both connect."""

    vehicle: Name = "rov1"
    """Name of the vehicle: the namespace of all keys, and the folder of its files."""
    listen: str = ""
    """Endpoint to listen on, such as tcp/127.0.0.1:7447."""
    connect: str = ""
    """Endpoint to connect to: the other site, the link process or a hub."""
    site: SiteName | Literal["*"] = "operator"
    """Name of the operator's site, in the keys of its messages; with a certificate, the name in the certificate."""
    certificates: str = ""
    """Folder of this site's ca.pem, certificate.pem and key.pem, which `farhand pki` makes; for quic/ and tls/."""
    sites: str = ""
    """For a robot with a certificate: the authority's sites.json with the rights of each site, read again when it changes.
    Without it the robot obeys every site with a certificate of the authority."""
    insecure: bool = False
    """Accept an endpoint of other machines that neither encrypts nor requests certificates, such as tcp/0.0.0.0:7447."""
    rate_bps: Annotated[float, msgspec.Meta(ge=0)] = 0.0
    """Capacity of the link in each direction [bit/s]; 0: more than enough.

    On a narrow link each flow has its share.
    """
    lease_s: Wait = 120.0
    """Silence after which the transport itself gives up [s]; the application notices much earlier."""
    handshake_timeout_s: Wait = 60.0
    """Longest time for a connection to open [s]; a handshake takes four one-way delays."""

    def __post_init__(self) -> None:
        """Refuse a rate that is too low for any message, and malformed endpoints."""
        if 0.0 < self.rate_bps < LEAST_BPS:
            raise ValueError(
                f"expected rate_bps of 0 (no limit) or at least {LEAST_BPS:g} bit/s, got {self.rate_bps:g}"
            )
        for field in ("listen", "connect"):
            if (endpoint := getattr(self, field)) and (fault := endpoint_fault(endpoint)):
                raise ValueError(f"{field}: {fault}")
            secure = scheme_of(endpoint) in SECURE
            if endpoint and secure and not self.certificates:
                raise ValueError(
                    f"certificates: the folder that `farhand pki` made for this site, for {endpoint}"
                )
            if endpoint and self.certificates and not secure:
                expected = f"{'/ or '.join(SECURE)}/ and HOST:PORT, as certificates are given"
                raise ValueError(f"{field}: {expected}, got {endpoint!r}")
            if _is_open(endpoint) and not self.insecure:
                expected = (
                    "a quic/ endpoint and certificates (farhand pki), as anybody could command over this one; "
                    "in a network of your own alone, insecure = true (--insecure)"
                )
                raise ValueError(f"{field}: {expected}, got {endpoint!r}")
        if self.sites and not (self.certificates and self.listen):
            raise ValueError(
                "sites: a list for a robot that listens with a certificate; behind a hub the hub has the list"
            )

    @property
    def certificate_folder(self) -> Path:
        """The folder of the site's certificate, where `certificates` names one."""
        return user_path(self.certificates, "certificates")

    @property
    def is_open(self) -> bool:
        """True if the link leads to other machines without encryption."""
        return _is_open(self.listen) or _is_open(self.connect)

    @property
    def endpoint(self) -> str:
        """Endpoint to listen on or to connect to."""
        return self.listen or self.connect

    @property
    def is_of_robot(self) -> bool:
        """True for a robot's end: it listens, or serves every site of a hub."""
        return bool(self.listen) or self.site == EVERY_SITE

    @property
    def speaks_as(self) -> str:
        """Name of an operator's site in its keys; `EVERY_SITE` of a robot's end."""
        if self.is_of_robot:
            return EVERY_SITE
        if not self.certificates:
            return self.site
        return common_name(read_certificate(self.certificate_folder / CERTIFICATE_FILE))


def _is_open(endpoint: str) -> bool:
    """Decide whether an endpoint leads to other machines without encryption."""
    if not endpoint or scheme_of(endpoint) in SECURE:
        return False
    return not is_loopback(endpoint_address(endpoint)[0])


def scheme_of(endpoint: str) -> str:
    """Return the scheme of an endpoint, such as tcp."""
    return endpoint.partition("/")[0]


def zenoh_configuration(settings: EndpointSettings) -> dict[str, Any]:
    """Return the transport's configuration of a site.

    A listening site has access rules, too: see `with_access_rules`.
    """
    configuration = {
        **bare_configuration(settings),
        "namespace": settings.vehicle,
        # A hub carries messages from one region to the other, and never within one.
        "region_name": ROBOTS if settings.is_of_robot else OPERATORS,
    }
    return (
        with_access_rules(configuration, settings.vehicle, settings.listen, settings.sites)
        if settings.listen
        else configuration
    )


def bare_configuration(settings: EndpointSettings) -> dict[str, Any]:
    """Return the transport's configuration: one explicit connection, and no discovery."""
    handshake_ms = round(settings.handshake_timeout_s * 1000)
    endpoints = (settings.listen, settings.connect, *_beside(settings.listen))
    return {
        "mode": "peer",
        "listen": {"endpoints": _with_options(settings.listen) + _beside(settings.listen)},
        "connect": {
            "endpoints": _with_options(settings.connect),
            "timeout_ms": -1,
            "exit_on_failure": False,
            "retry": {"period_init_ms": 200, "period_max_ms": 500, "period_increase_factor": 1.5},
        },
        # Gossip would let the sites connect directly, past the link process.
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "timestamping": {"enabled": False},
        "queries_default_timeout": handshake_ms,
        "transport": {
            "unicast": {
                "open_timeout": handshake_ms,
                "accept_timeout": handshake_ms,
                # Limits the idle connections that a stranger opens; each costs a descriptor.
                "accept_pending": 1000,
                "max_sessions": MOST_SESSIONS,
            },
            "shared_memory": {"enabled": False},
            "link": {
                # A mistyped endpoint must not send secrets in the clear.
                "protocols": sorted({scheme_of(end) for end in endpoints if end}),
                "tls": _tls(settings.certificate_folder) if settings.certificates else {},
                # By default a stranger's gigabyte would be assembled in memory before anybody looks at it.
                "rx": {"max_message_size": MAX_BYTES + _ENVELOPE_BYTES},
                "tx": {
                    "lease": round(settings.lease_s * 1000),
                    "keep_alive": 4,
                    "queue": {
                        # The largest message needs five batches; on a live link none may wait for room.
                        "size": dict.fromkeys(
                            ("real_time", "interactive_high", "data_high", "data", "data_low"), 16
                        ),
                        "congestion_control": {
                            "drop": {"wait_before_drop": 20_000},
                            "block": {"wait_before_close": 120_000_000},
                        },
                    },
                },
            },
        },
    }


def _with_options(endpoint: str) -> list[str]:
    if scheme_of(endpoint) == "quic" and "?" not in endpoint:
        address, hash_, configuration = endpoint.partition("#")
        endpoint = f"{address}{_QUIC_OPTIONS}{hash_}{configuration}"
    return [endpoint] if endpoint else []


def _beside(listen: str) -> list[str]:
    """Return where a robot that listens for QUIC also listens: TLS at the same port, for sites that UDP does not reach."""
    address = listen.partition("/")[2].partition("#")[0].partition("?")[0]
    return [f"tls/{address}"] if scheme_of(listen) == "quic" else []


def _tls(folder: Path) -> dict[str, Any]:
    """Return the transport's TLS settings for a site: each end requests the other one's certificate."""
    certificate, key = str(folder / CERTIFICATE_FILE), str(folder / KEY_FILE)
    return {
        "root_ca_certificate": str(folder / CA_FILE),
        "listen_certificate": certificate,
        "listen_private_key": key,
        "connect_certificate": certificate,
        "connect_private_key": key,
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
    }
