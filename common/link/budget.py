"""Budget of each flow on a narrow link, so that commands and stops never wait behind a report.

Streams of which only the newest message counts get a share of the rate and skip what does not fit. Bulk is
sent in parts, each requested when the previous one was confirmed. Pictures come after everything else, and have a share
as well. The rest of the rate is for commands, stops and their acknowledgements, which are never delayed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from farhand.common.wire import keys
from farhand.common.wire.keys import Channel

if TYPE_CHECKING:
    from farhand.common.link.interface import Link

OVERHEAD_BYTES = 70
"""Bytes that Zenoh (about 30), TCP and IP (40) add to a message, for its budget [B]."""

_SHARES: dict[Channel, float] = {
    keys.TELEMETRY: 0.45,
    keys.PATH: 0.15,
    keys.PICTURE: 0.25,
    keys.INPUT: 0.45,
    keys.HEARTBEAT: 0.20,
}
LEAST_PICTURE_BPS = 30_000.0
"""Rate of a link below which no pictures are sent: its reports would suffer [bit/s]."""
_WHOLE_BYTES, _LEAST_PART_BYTES = 32_768, 256
_PART_S = 0.4


def budget_bytes_s(channel: Channel, rate_bps: float) -> float:
    """Return the budget of a channel [B/s]; 0: as much as it needs.

    Args:
        channel: Channel.
        rate_bps: Capacity of the link in each direction [bit/s]; 0: more than enough.
    """
    return _SHARES.get(channel, 0.0) * rate_bps / 8


def limit_flows(link: Link, rate_bps: float) -> None:
    """Give every stream of a site its share of a link of this rate [bit/s]; 0: more than enough."""
    for channel in _SHARES:
        link.limit(channel, budget_bytes_s(channel, rate_bps))


def part_bytes(rate_bps: float) -> int:
    """Return the size of the parts in which bulk is sent [B]; a stop waits for at most one of them.

    Args:
        rate_bps: Capacity of the link in each direction [bit/s]; 0: more than enough.
    """
    if not rate_bps:
        return _WHOLE_BYTES
    return max(_LEAST_PART_BYTES, min(_WHOLE_BYTES, round(_PART_S * rate_bps / 8)))


def period_s(channel: Channel, wanted_hz: float, n_bytes: int, rate_bps: float) -> float:
    """Return the time between two messages of a stream, as wanted or as its budget allows [s].

    Args:
        channel: Channel.
        wanted_hz: Wanted rate [Hz].
        n_bytes: Size of a message [B].
        rate_bps: Capacity of the link [bit/s]; 0: more than enough.
    """
    budget = budget_bytes_s(channel, rate_bps)
    return max(1.0 / wanted_hz, (n_bytes + OVERHEAD_BYTES) / budget if budget else 0.0)
