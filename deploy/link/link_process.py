"""`farhand link`: the relay and its control socket, until a signal ends them."""

from __future__ import annotations

import asyncio
import logging
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from farhand.common.address import Address
from farhand.common.impairment.link_control import CONTROL_PORT
from farhand.common.impairment.link_profile import find_profile, load_profiles
from farhand.deploy.link.relay import Relay
from farhand.deploy.link.relay_control import ControlServer

log = logging.getLogger(__name__)

PROFILES_FILE = Path(__file__).parents[1] / "link_profiles.toml"


async def run_link(
    listen: Address,
    target: Address,
    control: Address = ("127.0.0.1", CONTROL_PORT),
    *,
    profile: str = "geo",
    seed: int = 0,
    profiles_file: Path = PROFILES_FILE,
    ready: Callable[[Address, Address], None] | None = None,
) -> None:
    """Be the link until SIGINT, SIGTERM or cancellation.

    Args:
        listen: Where the local site dials; port 0 takes a free one.
        target: Where the remote site listens.
        control: Where `farhand.common.impairment.link_control.RelayControl` connects.
        profile: Name of a profile in `profiles_file`.
        seed: Of all that is random.
        profiles_file: TOML, see `farhand.common.impairment.link_profile`.
        ready: Called once when both ports are bound, with the addresses of data and control.

    Raises:
        InvalidConfiguration: The profiles are malformed, or there is none of that name.
        LinkError: A port is in use, or an address is not of this machine.
    """
    profiles = load_profiles(profiles_file)
    timeline = find_profile(profiles, profile).over_time(f"link profile {profile}")
    relay = Relay(listen, target, timeline, seed, profile)
    server = ControlServer(relay, profiles, control)
    ended = asyncio.Event()
    with _ended_by_signals(ended):
        try:
            await relay.start()
            await server.start()
            log.info("the link is ready: %s port %d to %s port %d, %s", *relay.address, *target, profile)
            log.info("the link's control: %s port %d", *server.address)
            if ready:
                ready(relay.address, server.address)
            await _first_of(ended, relay)
        finally:
            await server.stop()
            await relay.stop()


async def _first_of(ended: asyncio.Event, relay: Relay) -> None:
    """Wait for a signal, or for the relay to fail; raises its failure."""
    signalled = asyncio.create_task(ended.wait())
    failed = asyncio.create_task(relay.wait())
    try:
        await asyncio.wait([signalled, failed], return_when=asyncio.FIRST_COMPLETED)
        if failed.done():
            failed.result()
    finally:
        signalled.cancel()
        failed.cancel()


@contextmanager
def _ended_by_signals(ended: asyncio.Event) -> Iterator[None]:
    """Let SIGINT and SIGTERM set the event; only the main thread may do so."""
    signals = (signal.SIGINT, signal.SIGTERM)
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    loop = asyncio.get_running_loop()
    for number in signals:
        loop.add_signal_handler(number, ended.set)
    try:
        yield
    finally:
        for number in signals:
            loop.remove_signal_handler(number)
