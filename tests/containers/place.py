"""Both sites in containers, as a user has them, and what can be seen of them from outside."""

from __future__ import annotations

import ipaddress
import json
import time
import urllib.request
from dataclasses import dataclass, field
from typing import Any

from farhand.common.address import free_port
from tests.containers.engine import ANSWER_S, RUN_S, Engine

MIB = 2**20
SERVICES = ("robot", "link", "operator")
ESTABLISHED = "01"
Peer = tuple[str, int, str, int]
"""Own address and port, the other's address and port."""


@dataclass
class Place:
    """The containers of compose.yaml.

    Args:
        engine: That runs them.
        files: Compose files.
        variables: Environment variables of every command.
    """

    engine: Engine
    files: tuple[str, ...] = ("compose.yaml",)
    variables: dict[str, str] = field(default_factory=dict)
    page_port: int = field(default_factory=free_port)

    @property
    def address(self) -> str:
        """Of the published page."""
        return f"http://127.0.0.1:{self.page_port}"

    def up(self) -> float:
        """Start all of it and wait for the page. Returns how long that took [s]."""
        began_s = time.monotonic()
        self.compose("up", "--no-build", "--detach")
        self.engine.await_words("operator", "the page is at", RUN_S)
        assert self.page_answers(), self.engine.all_words(self.files)
        return time.monotonic() - began_s

    def compose(self, *arguments: str) -> str:
        """Run Compose, which must succeed."""
        variables = {"FARHAND_PAGE_PORT": str(self.page_port)} | self.variables
        done = self.engine.compose(*arguments, files=self.files, timeout_s=RUN_S, **variables)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def page_answers(self) -> bool:
        """Whether the published port gives a page."""
        try:
            with urllib.request.urlopen(self.address, timeout=1.0) as answer:
                return answer.status == 200
        except OSError:
            return False

    def run(self, service: str, *command: str) -> str:
        """What a command in a running container prints."""
        return self.engine.do("exec", self.engine.container(service), *command)

    def status(self, service: str, *arguments: str) -> tuple[int, dict[str, Any]]:
        """Exit status and answer of a `farhand status` in a container."""
        command = ("exec", self.engine.container(service), "farhand", "status", "--json", *arguments)
        done = self.engine.run(self.engine.docker, *command, timeout_s=ANSWER_S)
        return done.returncode, json.loads(done.stdout)

    def troubles(self, service: str) -> set[str]:
        """Codes of the troubles that a container's process tells."""
        return {trouble["code"] for trouble in self.status(service)[1]["troubles"]}

    def await_troubles(self, service: str, expected: set[str], timeout_s: float = 120.0) -> None:
        """Ask a container's process until it tells these troubles and no others."""
        until_s = time.monotonic() + timeout_s
        while (told := self.troubles(service)) != expected:
            assert time.monotonic() < until_s, f"{service} tells {told}, not {expected}"

    def networks(self, service: str) -> dict[str, str]:
        """A container's address in each of its networks, by the network's own name."""
        found = json.loads(self.engine.do("inspect", self.engine.container(service)))[0]
        prefix = f"{self.engine.project}_"
        return {
            name.removeprefix(prefix): network["IPAddress"]
            for name, network in found["NetworkSettings"]["Networks"].items()
        }

    def connections(self, service: str, protocol: str = "tcp") -> set[Peer]:
        """The connections that are open in a container, as its kernel lists them; loopback left out."""
        open_now = set()
        for line in self.run(service, "cat", f"/proc/net/{protocol}").splitlines()[1:]:
            words = line.split()
            own, other, state = words[1], words[2], words[3]
            if state == ESTABLISHED and not _address(own)[0].startswith("127."):
                open_now.add((*_address(own), *_address(other)))
        return open_now


def _address(text: str) -> tuple[str, int]:
    number, port = text.split(":")
    packed = int(number, 16).to_bytes(4, "little")
    return str(ipaddress.IPv4Address(packed)), int(port, 16)
