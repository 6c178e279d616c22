"""What each flow may take of a narrow link, so that commands and stops never wait behind a report.

Streams of which only the newest counts get a share of the rate and skip what does not fit. Bulk travels
in parts, each asked for when the one before was confirmed. What is left is for commands, stops and their
acknowledgements, which nothing holds back.
"""

from __future__ import annotations

from farhand.common.link.link import OVERHEAD_BYTES, Link
from farhand.common.wire import keys
from farhand.common.wire.keys import Channel

_SHARES: dict[Channel, float] = {
    keys.TELEMETRY: 0.45,
    keys.PATH: 0.15,
    keys.INPUT: 0.45,
    keys.HEARTBEAT: 0.20,
}
_WHOLE_BYTES, _LEAST_PART_BYTES = 32_768, 256
_PART_S = 0.4


def budget_bytes_s(channel: Channel, rate_bps: float) -> float:
    """What a channel may take of a link [B/s]; 0: as much as it needs.

    Args:
        channel: Which.
        rate_bps: What the link carries each way [bit/s]; 0: more than enough.
    """
    return _SHARES.get(channel, 0.0) * rate_bps / 8


def limit_flows(link: Link, rate_bps: float) -> None:
    """Give every stream of a site its share of a link of this rate [bit/s]; 0: more than enough."""
    for channel in _SHARES:
        link.limit(channel, budget_bytes_s(channel, rate_bps))


def part_bytes(rate_bps: float) -> int:
    """How large the parts are in which bulk travels [B]: at most so much holds up a stop.

    Args:
        rate_bps: What the link carries each way [bit/s]; 0: more than enough.
    """
    if not rate_bps:
        return _WHOLE_BYTES
    return max(_LEAST_PART_BYTES, min(_WHOLE_BYTES, round(_PART_S * rate_bps / 8)))


def period_s(channel: Channel, wanted_hz: float, n_bytes: int, rate_bps: float) -> float:
    """Time between two messages of a stream, as wanted or as its budget allows [s].

    Args:
        channel: Which.
        wanted_hz: How often it is sent [Hz].
        n_bytes: Size of a message [B].
        rate_bps: What the link carries [bit/s]; 0: more than enough.
    """
    budget = budget_bytes_s(channel, rate_bps)
    return max(1.0 / wanted_hz, (n_bytes + OVERHEAD_BYTES) / budget if budget else 0.0)
