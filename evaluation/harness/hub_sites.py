"""Hub, relay and robots as processes, and the operators' ends of the link in this process."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from datetime import datetime
from pathlib import Path

from farhand.common.address import free_port
from farhand.common.impairment.link_control import RelayControl
from farhand.common.link.endpoint import EVERY_SITE, EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.common.mode_table import ControlMode
from farhand.deploy.pki.registry import Registry
from farhand.deploy.pki.throw_away import Transport
from farhand.evaluation.harness.farhand_process import HOST, ReadyProcess
from farhand.evaluation.harness.hub_operator import TASK, HubOperator

_DAYS = 30


class HubSites:
    """A hub with the certificates of its sites, until the end of the block.

    Args:
        robots: Names of the robots.
        operators: Names of the operators.
        transport: Scheme of the endpoints.
    """

    def __init__(self, robots: tuple[str, ...], operators: tuple[str, ...], transport: Transport = "quic"):
        self.robots, self.operators, self._transport = robots, operators, transport
        self._port = free_port("tcp" if transport == "tcp" else "quic")
        self._stack = ExitStack()
        self.folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="farhand-hub-")))
        """Data folder of all sites; removed with the block."""
        self._registry = None
        if transport != "tcp":
            self._registry = Registry.create(self.folder / "pki", "throw-away")
            self._registry.issue("hub", "hub", (HOST,), _DAYS)
            for name in robots:
                self._registry.issue(name, "robot", (), _DAYS)
            for name in operators:
                self._registry.issue(name, "operator", (), _DAYS)
        self.start_hub()
        self._stack.callback(lambda: self.hub.kill())  # noqa: PLW0108 (the present one)

    def __enter__(self) -> HubSites:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def start_hub(self) -> float:
        """Start the hub; return when it was ready [s]."""
        sites = [f"--sites={self.folder / 'pki' / 'sites.json'}"] if self._registry is not None else []
        self.hub = ReadyProcess(
            "hub", f"--listen={self._endpoint(self._port)}", *self._identity("hub"), *sites
        )
        return self.hub.ready_s

    def start_relay(self) -> RelayControl:
        """Start a simulated link in front of the hub; return its control. Robots that start later use it."""
        link = ReadyProcess(
            "link",
            f"--listen={HOST}:0",
            f"--target={HOST}:{self._port}",
            f"--control={HOST}:0",
            "--profile=lan",
        )
        self._stack.callback(link.kill)
        self._relay_port = link.ready["port"]
        return RelayControl(HOST, link.ready["control_port"])

    def start_robots(self, through_relay: bool = False) -> None:
        """Start every robot's process."""
        port = self._relay_port if through_relay else self._port
        for name in self.robots:
            robot = ReadyProcess(
                "remote", f"--connect={self._endpoint(port)}", f"--vehicle={name}", f"--task={TASK}",
                *self._identity(name), f"--data-dir={self.folder}",
            )  # fmt: skip
            self._stack.callback(robot.kill)

    def open_direct(self) -> HubOperator:
        """Start a robot that listens without a hub, and return its operator: the peer of those at the hub."""
        name, port = "direct", free_port("tcp" if self._transport == "tcp" else "quic")
        if self._registry is not None:
            self._registry.issue(name, "robot", (HOST,), _DAYS)
        robot = ReadyProcess(
            "remote", f"--listen={self._endpoint(port)}", f"--vehicle={name}", f"--task={TASK}", *self._identity(name),
            f"--data-dir={self.folder}",
        )  # fmt: skip
        self._stack.callback(robot.kill)
        site = self.operators[0]
        link = ZenohLink(
            EndpointSettings(
                connect=self._endpoint(port), vehicle=name, site=site, certificates=self._certificates(site)
            )
        )
        self._stack.callback(link.close)
        operator = HubOperator(link, site, name)
        self._stack.callback(operator.close)
        return operator

    def robot_events(self, robot: str) -> Path:
        """Return the event log of a robot, one JSON object per line."""
        return self.folder / "robot" / robot / "events.jsonl"

    def links(self, ends: Sequence[tuple[str, str]]) -> list[ZenohLink]:
        """Open operators' ends of the link to robots, or with `EVERY_SITE` the robots' own ends, all at the same time.

        Args:
            ends: Robot and site of each.
        """
        with ThreadPoolExecutor(len(ends)) as pool:
            opened = list(pool.map(self._opened, ends))
        for link in opened:
            self._stack.callback(link.close)
        return opened

    def _opened(self, end: tuple[str, str]) -> ZenohLink:
        robot, site = end
        settings = EndpointSettings(
            connect=self._endpoint(self._port), vehicle=robot, site=site,
            certificates=self._certificates(robot if site == EVERY_SITE else site),
        )  # fmt: skip
        return ZenohLink(settings)

    def open_operators(self) -> list[HubOperator]:
        """Return a site of each operator for each robot."""
        ends = [(robot, site) for robot in self.robots for site in self.operators]
        operators = [
            HubOperator(link, site, robot) for link, (robot, site) in zip(self.links(ends), ends, strict=True)
        ]
        for operator in operators:
            self._stack.callback(operator.close)
        return operators

    def held_s(self, robot: str, before: int) -> float:
        """Return when a robot was in HOLD again by its own log, in seconds of the epoch [s].

        Args:
            robot: Name of the robot.
            before: Number of lines in its log before that.
        """
        lines = self.robot_events(robot).read_text("utf-8").splitlines()[before:]
        times = [event["time"] for event in map(json.loads, lines) if event.get("mode") == ControlMode.HOLD]
        return datetime.fromisoformat(times[0]).timestamp() if times else float("inf")

    def hub_cpu_s(self) -> float:
        """Return the processor time that the hub's process has used [s]."""
        fields = Path(f"/proc/{self.hub.pid}/stat").read_text("ascii").rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def _endpoint(self, port: int) -> str:
        return f"{self._transport}/{HOST}:{port}"

    def _certificates(self, name: str) -> str:
        return str(self._registry.folder_of(name)) if self._registry is not None else ""

    def _identity(self, name: str) -> list[str]:
        return [f"--certificates={self._certificates(name)}"] if self._registry is not None else []
