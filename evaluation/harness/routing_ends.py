"""Ends of robots and sites at a hub that exchange messages with the names of both, and count the misrouted ones."""

from __future__ import annotations

import threading
import time

from farhand.common.errors import ProcessFailed
from farhand.common.link.endpoint import EVERY_SITE
from farhand.common.link.interface import Request
from farhand.common.link.link import ZenohLink
from farhand.common.wire import keys
from farhand.evaluation.harness.hub_operator import PATIENCE_S


class _End:
    """One end of the link, which counts what arrives, and what of it was for another end."""

    def __init__(self, link: ZenohLink, robot: str, site: str):
        self._link, self._robot, self._site, self._lock = link, robot, site, threading.Lock()
        self.arrived = self.wrong = 0

    def _named(self, robot: str, site: str) -> bytes:
        return f"{robot} {site}".encode()

    def _count(self, data: bytes) -> None:
        robot, site = data.decode().split(" ")
        mine = robot == self._robot and self._site in (site, EVERY_SITE)
        with self._lock:
            self.arrived += 1
            self.wrong += not mine


class RobotEnd(_End):
    """Robot's end: it answers each question with the question, and tells everybody its name."""

    def __init__(self, link: ZenohLink, robot: str):
        super().__init__(link, robot, EVERY_SITE)
        link.serve(keys.COMMAND, self._answer)
        for channel in (keys.INPUT, keys.STOP):
            link.subscribe(channel, self._count)

    def speak(self) -> None:
        """Send a report and an event to all sites."""
        for channel in (keys.TELEMETRY, keys.EVENT):
            self._link.send(channel, self._named(self._robot, "all"))

    def _answer(self, request: Request) -> None:
        self._count(request.data)
        request.answer(request.data)


class SiteEnd(_End):
    """Operator's end: it asks and sends under its own name, and hears its robot."""

    def __init__(self, link: ZenohLink, robot: str, site: str):
        super().__init__(link, robot, site)
        for channel in (keys.TELEMETRY, keys.EVENT):
            link.subscribe(channel, self._hear)

    def ask_until_answered(self) -> None:
        """Ask until the first answer comes: the site is connected then.

        Raises:
            ProcessFailed: When none comes.
        """
        give_up_s = time.monotonic() + PATIENCE_S
        while self._link.ask_and_wait(keys.COMMAND, self._named(self._robot, self._site), 1.0) is None:
            if time.monotonic() > give_up_s:
                raise ProcessFailed(f"{self._site} was never answered by {self._robot}")
            time.sleep(0.05)

    def speak(self) -> None:
        """Ask the robot, and send it an input and a stop."""
        named = self._named(self._robot, self._site)
        for channel in (keys.INPUT, keys.STOP):
            self._link.send(channel, named)
        if (answer := self._link.ask_and_wait(keys.COMMAND, named, 5.0)) is not None:
            self._count(answer)

    def _hear(self, data: bytes) -> None:
        robot = data.decode().split(" ")[0]
        self._count(f"{robot} {self._site}".encode())
