"""Peers that a robot with certificates refuses, each with what it tries and the reason that both sides give.

The site's words are those that `farhand local` prints; a peer that is no site of ours has none.
"""

from __future__ import annotations

import contextlib
import json
import shutil
import socket
import ssl
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import zenoh

from farhand.common.link.access import explain_right
from farhand.common.link.certificates import SiteCertificate
from farhand.common.link.connection_faults import explain_silence, find_refusal
from farhand.common.link.endpoint import MOST_SESSIONS, EndpointSettings, zenoh_configuration
from farhand.common.link.link import ZenohLink
from farhand.common.wire import keys
from farhand.common.wire.reason_words import sentence
from farhand.deploy.pki.registry import Registry
from farhand.evaluation.harness.farhand_process import HOST

ROBOT, REASON_S, DAYS, FLOOD_S = "rov1", 10.0, 30, 3.0
_LARGE_BYTES, _FLOOD_HZ = 200_000, 1000


@dataclass(frozen=True)
class Bench:
    """Robot with its relay, and the authority.

    Args:
        folder: Folder of the certificates.
        registry: The authority.
        port: Port of the relay.
    """

    folder: Path
    registry: Registry
    port: int

    @property
    def endpoint(self) -> str:
        """Endpoint that a site dials."""
        return f"quic/{HOST}:{self.port}"

    def issued(self, name: str, shift_days: float = 0.0, days: int = DAYS) -> Path:
        """Return the folder of a new operator's certificate, made some days ago or ahead."""
        now = datetime.now(UTC) + timedelta(days=shift_days)
        return self.registry.issue(name, "operator", (), days, now)

    def settings(self, name: str) -> EndpointSettings:
        """Return the settings of a site."""
        return EndpointSettings(connect=self.endpoint, certificates=str(self.registry.folder_of(name)))

    def raw(self, name: str) -> zenoh.Session:
        """Open a session of the transport that names every key in full."""
        configuration = zenoh_configuration(self.settings(name))
        del configuration["namespace"]
        return zenoh.open(zenoh.Config.from_json5(json.dumps(configuration)))


def until_connected(session: zenoh.Session) -> None:
    """Wait until a session has a connection, or for `REASON_S`."""
    until_s = time.monotonic() + REASON_S
    while not session.info.links() and time.monotonic() < until_s:
        time.sleep(0.02)


def _no_certificate(bench: Bench) -> str:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    plain = socket.create_connection((HOST, bench.port), REASON_S)
    with contextlib.suppress(OSError), context.wrap_socket(plain) as encrypted:
        encrypted.recv(1)
    try:
        EndpointSettings(connect=bench.endpoint)
    except ValueError as error:
        return str(error)
    return ""


def _other_authority(bench: Bench) -> str:
    other = Registry.create(bench.folder / "other", "other-fleet").issue("shore-1", "operator", (), DAYS)
    shutil.copy(bench.registry.folder_of(ROBOT) / "ca.pem", other)  # it trusts the robot
    return find_refusal(bench.endpoint, other)


def _expired(bench: Bench) -> str:
    folder = bench.issued("late", -5.0, 2)
    find_refusal(bench.endpoint, folder)
    return SiteCertificate.load(folder).fault()


def _not_yet(bench: Bench) -> str:
    folder = bench.issued("early", 5.0, 2)
    find_refusal(bench.endpoint, folder)
    return SiteCertificate.load(folder).fault()


def _wrong_name(bench: Bench) -> str:
    return find_refusal(f"quic/localhost:{bench.port}", bench.registry.folder_of("shore-1"))


def _asked(bench: Bench, name: str) -> str:
    """Command as a site, ask what it may do as its page does, and return that in words."""
    link = ZenohLink(bench.settings(name))
    try:
        answer, until_s = None, time.monotonic() + REASON_S
        while answer is None and time.monotonic() < until_s:
            answer = link.ask_and_wait(keys.RIGHT, b"", 2.0)
        link.ask_and_wait(keys.COMMAND, b"arm", 1.0)
        why = explain_right(answer, name, ROBOT) if answer is not None else None
        return sentence(why) if why is not None else ""
    finally:
        link.close()


def _other_robots(bench: Bench) -> str:
    bench.issued("shore-9")  # after the robot got its list
    return _asked(bench, "shore-9")


def _another_key(bench: Bench) -> str:
    with bench.raw("watcher") as session:
        until_connected(session)
        for _ in range(10):
            session.put(f"{ROBOT}/{keys.COMMAND.of('shore-1')}", b"arm")
            session.put(f"{ROBOT}/{keys.LEASE.of('shore-1')}", b"mine")
        time.sleep(1.0)
    return ""


def _large(bench: Bench) -> str:
    with bench.raw("watcher") as session:
        until_connected(session)
        for _ in range(10):
            session.put(f"{ROBOT}/{keys.STOP.of('watcher')}", bytes(_LARGE_BYTES))
        time.sleep(1.0)
    return ""


def _flood(bench: Bench) -> str:
    with bench.raw("watcher") as session:
        until_connected(session)
        began_s = time.monotonic()
        for number in range(round(_FLOOD_HZ * FLOOD_S)):
            session.put(f"{ROBOT}/{keys.HEARTBEAT.of('watcher')}", b"\xff" * 40)
            time.sleep(max(0.0, began_s + number / _FLOOD_HZ - time.monotonic()))
    return ""


def _too_many(bench: Bench) -> str:
    with contextlib.ExitStack() as closing:
        sessions = [closing.enter_context(bench.raw("shore-1")) for _ in range(MOST_SESSIONS)]
        for session in sessions:
            until_connected(session)
        return explain_silence(bench.settings("watcher"), connected=False)


def _plain(bench: Bench) -> str:
    settings = EndpointSettings(connect=f"tcp/{HOST}:{bench.port}")
    link = ZenohLink(settings)
    try:
        time.sleep(1.0)
        return explain_silence(settings, bool(link.connected_to()))
    finally:
        link.close()


PEERS: dict[str, tuple[Callable[[Bench], str], str, str]] = {
    "no certificate": (_no_certificate, "certificates: the folder that", "it shows no certificate"),
    "other CA": (_other_authority, "another authority has issued this site's", "another authority has issued its"),
    "expired": (_expired, "expired on", "its certificate has expired"),
    "not yet valid": (_not_yet, "not valid before", "not valid yet"),
    "wrong name": (_wrong_name, "not for localhost", "dials another name"),
    "observer commands": (lambda bench: _asked(bench, "watcher"), "only watch and stop", "watcher may only watch and stop"),
    "operator of another robot": (_other_robots, "does not name shore-9", "does not name shore-9"),
    "another's key": (_another_key, "", ""),
    "200 kB": (_large, "", "a message of watcher was dropped: more than"),
    "1 kHz": (_flood, "", "watcher sends too fast"),
    "a session too many": (_too_many, "as many sites are connected", f"{MOST_SESSIONS} connections are open"),
    "plain tcp": (_plain, "requests a certificate", "does not speak TLS"),
}  # fmt: skip
"""By name: what it tries, which returns the site's words; the reason in these, and the reason in the robot's log. An empty
reason is not asked for: the peer is no site of ours, or the transport denies in silence."""
