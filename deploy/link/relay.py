"""Relay between the sites, with the delay, loss, rate and outages of the simulated link.

The local site dials the relay, which dials the remote site. It carries TCP connections and UDP datagrams that arrive
at one port. To the sites it is a slow network, except that TCP's handshake is not delayed, and that TCP loses
nothing: loss, duplicates, corruption and reordering apply to datagrams alone.

Settings that change with time are a timeline, which is played in real time.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import Callable
from typing import Any

import msgspec

from farhand.common.address import Address, bind, show_address
from farhand.common.errors import InvalidConfiguration, PortTaken
from farhand.common.impairment.impairment import LinkSettings, Outage
from farhand.common.impairment.link_profile import LinkTimeline
from farhand.deploy.link.datagrams import Datagrams
from farhand.deploy.link.relay_connection import SOCKET_BUFFER_BYTES
from farhand.deploy.link.relay_pipe import Meter
from farhand.deploy.link.streams import Streams


class TimelinePlayer:
    """Player of a timeline of settings in the running event loop.

    Args:
        apply: Called with each of the settings at their time.
    """

    def __init__(self, apply: Callable[[LinkSettings], None]):
        self._apply = apply
        self._next: asyncio.TimerHandle | None = None

    def play(self, timeline: LinkTimeline) -> None:
        """Begin a timeline now, instead of the one under way."""
        self.stop()
        self._take(timeline, asyncio.get_running_loop().time(), 0.0)

    def stop(self) -> None:
        """Leave the settings as they are."""
        if self._next:
            self._next.cancel()
        self._next = None

    def _take(self, timeline: LinkTimeline, began_s: float, elapsed_s: float) -> None:
        self._apply(timeline.at(elapsed_s))
        if (next_s := timeline.next_change_s(elapsed_s)) is not None:
            loop = asyncio.get_running_loop()
            self._next = loop.call_at(began_s + next_s, self._take, timeline, began_s, next_s)


log = logging.getLogger(__name__)

MAX_OUTAGE_S = 86_400.0
_FREE_PORT_TRIES = 20


class Relay:
    """Relay of every connection and every datagram from `listen` to `target`, through the link's impairments.

    All of it runs in one event loop, including the constructor.

    Args:
        listen: Address for the local site to dial; port 0 takes one that is free for TCP and UDP.
        target: Address of the remote site, which may start later.
        settings: Settings of both directions, fixed or over time; `change` replaces them.
        seed: Seed of all random numbers, together with the seeds of the settings.
        profile: Name of the settings, for the status.
    """

    def __init__(
        self,
        listen: Address,
        target: Address,
        settings: LinkSettings | LinkTimeline,
        seed: int = 0,
        profile: str = "custom",
    ):
        self._listen, self._target = listen, target
        self._timeline = settings if isinstance(settings, LinkTimeline) else LinkTimeline(settings)
        self._settings, self._profile = self._timeline.at(0.0), profile
        self._player = TimelinePlayer(self._apply)
        self._meters = (Meter(), Meter())
        self._streams = Streams(target, self._settings, seed, self._meters)
        self._datagrams = Datagrams(target, self._settings, seed, self._meters)
        self._outage: Outage = "none"
        self._outage_end: asyncio.TimerHandle | None = None

    @property
    def address(self) -> Address:
        """Address on which the relay listens, with the port that it got."""
        return self._listen

    @property
    def settings(self) -> LinkSettings:
        """Settings in force."""
        return self._settings

    async def start(self) -> None:
        """Bind the port and begin to accept.

        Raises:
            LinkError: The port is in use, or the address is not of this machine.
        """
        listener, sock = _bind_both(self._listen)
        host, port, *_ = listener.getsockname()
        self._listen = (host, port)
        self.change(self._timeline, self._profile)
        self._streams.start(listener)
        await self._datagrams.start(sock)

    async def wait(self) -> None:
        """Wait until the relay is stopped; raise the error that ended it otherwise."""
        await self._streams.wait()

    async def stop(self) -> None:
        """Cut all connections and release the port."""
        self.clear()
        self._player.stop()
        await self._streams.stop()
        await self._datagrams.stop()

    def change(self, settings: LinkSettings | LinkTimeline, profile: str = "custom") -> None:
        """Replace the settings for what is sent from now on; a timeline begins now."""
        self._timeline = settings if isinstance(settings, LinkTimeline) else LinkTimeline(settings)
        self._profile = profile
        for warning in self._timeline.base.short_queues():
            log.warning(warning)
        self._player.play(self._timeline)
        if (beyond := self._settings.beyond_streams()) and self._streams.connections:
            log.warning("the TCP connections are carried without %s: TCP repairs them", ", ".join(beyond))
        log.info("the link is now: %s", profile)

    def outage(self, kind: Outage, duration_s: float = 0.0) -> None:
        """Interrupt both directions for a while; a present outage ends.

        Args:
            kind: `stall` holds everything and delivers it afterwards; `blackhole` swallows everything and
                cuts the connections at its end; `reset` cuts them now and refuses new ones meanwhile;
                `none` ends the present outage. Datagrams have no connection: `blackhole` and `reset` swallow them.
            duration_s: Duration [s].

        Raises:
            InvalidConfiguration: The duration is not above 0 and finite; nothing has changed.
        """
        if kind != "none" and not 0 < duration_s <= MAX_OUTAGE_S:
            expected = f"expected seconds above 0 and up to {MAX_OUTAGE_S:g}, not {duration_s}"
            raise InvalidConfiguration("outage", "duration_s", expected)
        self.clear()
        if kind == "none":
            return
        loop = asyncio.get_running_loop()
        self._outage, self._outage_end = kind, loop.call_later(duration_s, self.clear)
        for carrier in (self._streams, self._datagrams):
            carrier.interrupt(kind, self._outage_end.when())
        log.info("outage: %s for %g s", kind, duration_s)

    def clear(self) -> None:
        """End the present outage, if any."""
        if not self._outage_end:
            return
        self._outage_end.cancel()
        kind, self._outage, self._outage_end = self._outage, "none", None
        for carrier in (self._streams, self._datagrams):
            carrier.resume()
        log.info("outage: %s is over", kind)

    def rebind(self) -> None:
        """Change the path, as a satellite hand-over does, or a NAT that forgets what it has carried.

        Datagrams go on from other ports. The TCP connections carry nothing more and are not closed; new ones work.
        """
        self._datagrams.rebind()
        self._streams.forget()
        log.info("datagrams go on from other ports, and the TCP connections are forgotten")

    def status(self) -> dict[str, Any]:
        """Return the settings, the outage, the traffic and the relay's own lateness, fit for JSON."""
        remaining_s = 0.0
        if self._outage_end:
            remaining_s = max(0.0, self._outage_end.when() - asyncio.get_running_loop().time())
        streams, datagrams = self._streams, self._datagrams
        return {
            "listen": show_address(self._listen),
            "target": show_address(self._target),
            "profile": self._profile,
            "settings": msgspec.to_builtins(self._settings),
            "outage": {"kind": self._outage, "remaining_s": remaining_s},
            "connections": streams.connections + datagrams.flows,
            "transport": "udp" if datagrams.flows else "tcp" if streams.connections else "",
            "accepted": streams.accepted + datagrams.accepted,
            "refused": streams.refused,
            "senders": datagrams.senders,
            "rebinds": datagrams.rebinds,
            "streams_ignore": self._settings.beyond_streams() if streams.connections else [],
            "target_error": datagrams.target_error if datagrams.flows else streams.target_error,
            "uplink": self._traffic(0),
            "downlink": self._traffic(1),
        }

    def _traffic(self, direction: int) -> dict[str, Any]:
        way = self._datagrams.ways[direction]
        queued_bytes = self._streams.queued_bytes(direction) + way.queued_bytes
        return {
            "queued_bytes": queued_bytes, **self._meters[direction].report(), "datagrams": way.report(),
        }  # fmt: skip

    def _apply(self, settings: LinkSettings) -> None:
        self._settings = settings
        self._streams.change(settings)
        self._datagrams.change(settings)


def _bind_both(listen: Address) -> tuple[socket.socket, socket.socket]:
    """Return a listening TCP socket and a UDP socket at the same address; of free ports one that is free for both."""
    tries = _FREE_PORT_TRIES if listen[1] == 0 else 1
    for left in reversed(range(tries)):
        listener = bind(listen, SOCKET_BUFFER_BYTES)
        with contextlib.ExitStack() as given_up:
            given_up.callback(listener.close)
            try:
                sock = bind((listen[0], listener.getsockname()[1]), kind=socket.SOCK_DGRAM)
            except PortTaken:
                if not left:
                    raise
                continue
            given_up.pop_all()
            return listener, sock
    raise AssertionError
