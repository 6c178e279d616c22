"""Observer of all robots at a hub: which are there, and the newest report of each."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import zenoh

from farhand.common.clock import elapsed_s
from farhand.common.errors import InvalidInput
from farhand.common.link.budget import Silence
from farhand.common.link.endpoint import OPERATORS, EndpointSettings, bare_configuration
from farhand.common.link.path_probe import Path, PathProbe
from farhand.common.link.questions import in_reader
from farhand.common.link.session import Session
from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.messages import Telemetry

_LOOK_S = 1.0
_ANY = "rov"
"""Name of any robot, for the question to the hub itself."""


@dataclass(frozen=True)
class RobotAtHub:
    """State of one robot, as its hub carries it.

    Args:
        name: Name of the robot.
        is_there: True if the robot is at the hub.
        report: Newest report; None before the first one.
        age_s: Time since it arrived [s].
    """

    name: str
    is_there: bool
    report: Telemetry | None
    age_s: float


class Fleet:
    """Observer of the robots at a hub, with a session and a thread of its own. It sends nothing to a robot.

    Args:
        settings: Endpoint of the hub, and the certificate of this site.
        robots: Names of robots that are observed; empty: all that are there.
    """

    def __init__(self, settings: EndpointSettings, robots: Sequence[str] = ()):
        self._robots = tuple(robots)
        self._found: tuple[str, ...] = ()
        self._heard: dict[str, tuple[bytes, float]] = {}
        self._decoded: dict[str, tuple[bytes, Telemetry | None]] = {}
        self._closed = threading.Event()
        self._session = Session(settings, _configuration)
        for robot in self._robots or ("*",):
            self._session.declare(partial(self._follow, robot))
        self._silence = Silence(settings.rate_bps)
        asked = f"{_ANY}/{keys.RIGHT.of(settings.speaks_as)}"
        self._probe = PathProbe(
            Path.of(settings, _configuration, asked, self._silence), lambda: self._silence.lasts_s,
            self._is_connected, partial(self._session.answers, asked), self._session.reopen,
        )  # fmt: skip
        self._thread = threading.Thread(target=self._run, name="fleet", daemon=True)
        self._thread.start()

    @property
    def is_connected(self) -> bool:
        """True while the hub is connected."""
        return self._is_connected()

    def states(self) -> tuple[RobotAtHub, ...]:
        """Return the state of each observed robot, by name."""
        found, now_s = set(self._found), elapsed_s()
        return tuple(
            self._state(name, name in found, now_s)
            for name in self._robots or sorted(found | set(self._heard))
        )

    def look(self) -> None:
        """Ask the hub now which robots are there; waits for the answer."""
        self._found = self._session.robots()

    def close(self) -> None:
        """End the session and the thread."""
        self._closed.set()
        self._probe.close()
        self._session.close()
        self._thread.join(timeout=10.0)

    def _run(self) -> None:
        while not self._closed.wait(_LOOK_S):
            self.look()

    def _follow(self, robot: str, session: zenoh.Session) -> Any:
        return session.declare_subscriber(f"{robot}/{keys.TELEMETRY.key}", in_reader(self._hear))

    def _hear(self, sample: zenoh.Sample) -> None:
        # Decoded when somebody looks: most reports are replaced before.
        self._silence.heard()
        name = str(sample.key_expr).partition("/")[0]
        if len(sample.payload) <= keys.TELEMETRY.most_bytes:
            self._heard[name] = (sample.payload.to_bytes(), elapsed_s())

    def _state(self, name: str, is_there: bool, now_s: float) -> RobotAtHub:
        data, heard_s = self._heard.get(name, (b"", now_s))
        known = self._decoded.get(name)
        if known is None or known[0] is not data:
            known = self._decoded[name] = (data, _report(data) if data else None)
        return RobotAtHub(name, is_there, known[1], now_s - heard_s)

    def _is_connected(self) -> bool:
        return bool(self._session.locators())


def _report(data: bytes) -> Telemetry | None:
    try:
        return decode(data, Telemetry)
    except InvalidInput:
        return None  # of another version


def _configuration(settings: EndpointSettings) -> dict[str, Any]:
    return bare_configuration(settings) | {"region_name": OPERATORS}


def follow_until(fleet: Fleet, holds: Callable[[], bool], patience_s: float) -> bool:
    """Look at a fleet until a condition holds; return False when the time is over."""
    until_s, pause = elapsed_s() + patience_s, threading.Event()
    while not holds():
        if elapsed_s() > until_s:
            return False
        pause.wait(0.05)
        fleet.look()
    return True
