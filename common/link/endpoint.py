"""Where a site listens and connects, and how the transport is set up for a slow link."""

from __future__ import annotations

from typing import Annotated, Any

import msgspec

from farhand.common.clock import Wait

LEAST_BPS = 80.0
"""The slowest modems carry so much [bit/s]."""


class EndpointSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where the transport listens and connects. The remote site listens, the local site connects."""

    vehicle: str = "rov1"
    """Name of the vehicle: the namespace of all keys."""
    listen: str = ""
    """Endpoint to listen on, such as tcp/127.0.0.1:7447."""
    connect: str = ""
    """Endpoint to connect to: the other site or the link process."""
    rate_bps: Annotated[float, msgspec.Meta(ge=0)] = 0.0
    """What the link carries each way [bit/s]; 0: more than enough. On a narrow one each flow has its share."""
    lease_s: Wait = 120.0
    """Silence after which the transport itself gives up [s]; the application notices much earlier."""
    handshake_timeout_s: Wait = 60.0
    """Longest time for a connection to open [s]; a handshake takes four one-way delays."""

    def __post_init__(self) -> None:
        """Refuse a rate at which no message would ever be whole."""
        if 0.0 < self.rate_bps < LEAST_BPS:
            raise ValueError(
                f"expected rate_bps of 0 (no limit) or at least {LEAST_BPS:g} bit/s, got {self.rate_bps:g}"
            )


def zenoh_configuration(settings: EndpointSettings) -> dict[str, Any]:
    """The transport's configuration: one explicit connection and nothing found by itself."""
    handshake_ms = round(settings.handshake_timeout_s * 1000)
    return {
        "mode": "peer",
        "namespace": settings.vehicle,
        "listen": {"endpoints": [settings.listen] if settings.listen else []},
        "connect": {
            "endpoints": [settings.connect] if settings.connect else [],
            "timeout_ms": -1,
            "exit_on_failure": False,
            "retry": {"period_init_ms": 200, "period_max_ms": 500, "period_increase_factor": 1.5},
        },
        # Gossip would let the sites connect directly, past the link process.
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "timestamping": {"enabled": True},
        "queries_default_timeout": handshake_ms,
        "transport": {
            "unicast": {"open_timeout": handshake_ms, "accept_timeout": handshake_ms},
            "shared_memory": {"enabled": False},
            "link": {
                "tx": {
                    "lease": round(settings.lease_s * 1000),
                    "keep_alive": 4,
                    "queue": {
                        "size": {"real_time": 16, "interactive_high": 16, "data_high": 16},
                        "congestion_control": {
                            "drop": {"wait_before_drop": 20_000},
                            "block": {"wait_before_close": 120_000_000},
                        },
                    },
                }
            },
        },
    }
