"""Robot and link as processes, and the operator's console in this process."""

from __future__ import annotations

import json
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from farhand.common.address import free_port
from farhand.common.errors import ProcessFailed
from farhand.common.impairment.link_control import RelayControl
from farhand.common.link.certificates import RIGHTS_FILE
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.common.task import TaskSet
from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.messages import Telemetry, Wish
from farhand.deploy.entry import own_command
from farhand.deploy.pki.registry import Registry
from farhand.deploy.pki.throw_away import Transport, transport_for
from farhand.deploy.places import find_cell, find_task
from farhand.evaluation.harness.farhand_process import HOST, ReadyProcess
from farhand.local_site.console.console import Console
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.teaching.library import Library
from farhand.local_site.workcell.workcell import make_workcell

PATIENCE_S = 120.0
_SITE = "operator"
_DAYS = 30


@dataclass(frozen=True)
class Heard:
    """Report of the robot as it arrived.

    Args:
        arrived_s: Arrival on this process's clock [s].
        report: The report.
    """

    arrived_s: float
    report: Telemetry

    @property
    def boot(self) -> str:
        """Identity of the robot's boot."""
        return self.report.stamp.boot

    @property
    def sent_s(self) -> float:
        """Time of sending on the robot's clock [s]."""
        return self.report.stamp.t_ns * 1e-9


class RealSites:
    """Robot, link and console, until the end of the block.

    Args:
        delay_s: First one-way delay [s]; None: the profile's.
        with_console: Whether to open a console; otherwise `run_demo` brings an operator of its own.
        task: Task of the robot.
        seed: Seed of the robot's noise and target, and of the hand.
        profile: Profile of the link.
        rate_bps: Capacity of the link as told to the sites [bit/s]; 0: more than enough.
        transport: Scheme of the endpoints; None for the one that suits the rate.
        listed: Whether the robot obeys only the sites of the registry's list, which is read again when it changes.
    """

    def __init__(
        self,
        delay_s: float | None,
        with_console: bool = True,
        task: str = "planar",
        seed: int = 0,
        profile: str = "lan",
        rate_bps: float = 0.0,
        transport: Transport | None = None,
        listed: bool = False,
    ):
        self._listed = listed
        self._task, self._delay_s, self._with_console, self._seed = task, delay_s, with_console, seed
        self._profile, self._rate_bps = profile, rate_bps
        self._folder = tempfile.TemporaryDirectory(prefix="farhand-")
        self._transport = transport or transport_for(rate_bps)
        self._robot_port = free_port("tcp" if self._transport == "tcp" else "quic")
        self.folder = Path(self._folder.name)
        """Data folder of the sites; removed with the block."""
        self._registry = None
        if self._transport != "tcp":
            self._registry = Registry.create(self.folder / "pki", "throw-away")
        self.heard: list[Heard] = []
        """Every report, in the order of arrival."""
        self._arrived = threading.Condition()

    def __enter__(self) -> RealSites:
        with ExitStack() as stack:
            stack.callback(self._folder.cleanup)
            self.robot = self._start_robot()
            stack.callback(self._kill_robot)
            self._link = ReadyProcess(
                "link", f"--listen={HOST}:0", f"--target={HOST}:{self._robot_port}", f"--control={HOST}:0",
                f"--profile={self._profile}",
            )  # fmt: skip
            stack.callback(self._link.kill)
            self.control = RelayControl(HOST, self._link.ready["control_port"])
            if self._delay_s is not None:
                settings = {"delay_ms": 1000.0 * self._delay_s}
                self.control.set(uplink=settings, downlink=settings)
            if self._with_console:
                self.open_console()
                stack.callback(self.close_console)
            self._ending = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.close()

    def run_demo(self, outage: str = "none") -> dict[str, Any]:
        """Have `farhand local --demo` do the job in a process of its own; return its result.

        Args:
            outage: As on the command line.

        Raises:
            ProcessFailed: It printed no result.
        """
        result = self.folder / "demo.json"
        arguments = [*self._demo_arguments(), f"--outage={outage}", f"--json={result}"]
        done = subprocess.run(
            own_command(*arguments), capture_output=True, text=True, encoding="utf-8", check=False
        )
        if not result.exists():
            *_, last = done.stderr.splitlines() or [f"it ended with status {done.returncode}"]
            raise ProcessFailed(last.removeprefix("farhand: "))
        return json.loads(result.read_text(encoding="utf-8"))

    def start_demo(self) -> ReadyProcess:
        """Start the job of `run_demo` without waiting; the caller ends it."""
        return ReadyProcess(*self._demo_arguments())

    def start_page(self) -> ReadyProcess:
        """Start a site that watches and serves its page; the caller ends it."""
        where = f"{HOST}:{self._link.ready['port']}"
        return ReadyProcess(
            "local", "--watch", "--site-name=page", f"--port={free_port()}", f"--connect={self._transport}/{where}",
            *self._identity("page"),
            f"--task={self._task}", f"--data-dir={self.folder / 'page'}", f"--link-rate-bps={self._rate_bps:g}",
        )  # fmt: skip

    @property
    def registry(self) -> Registry:
        """Authority of the certificates. Only over an encrypted transport."""
        assert self._registry is not None
        return self._registry

    @property
    def robot_events(self) -> Path:
        """Robot's event log, one JSON object per line."""
        return self.folder / "robot" / EndpointSettings().vehicle / "events.jsonl"

    def open_console(
        self, site_name: str = _SITE, wish: Wish = Wish.CONTROL, folder: Path | None = None
    ) -> float:
        """Open the operator's site; return when its transport opened, on this process's clock [s].

        Args:
            site_name: Name of the site.
            wish: Whether it takes the control of the robot, or watches.
            folder: Folder of its library; that of `run_demo` when not given.
        """
        task = find_task(self._task)
        place, library = make_workcell(task, find_cell(task)), Library(TaskSet([task]), folder or self.folder)
        endpoint = f"{self._transport}/{HOST}:{self._link.ready['port']}"
        self.link = ZenohLink(
            EndpointSettings(
                connect=endpoint,
                rate_bps=self._rate_bps,
                site=site_name,
                certificates=self._certificates(site_name),
            )
        )
        opened_s = time.monotonic()
        self.console = Console(library, self.link, site_name, wish=wish, rate_bps=self._rate_bps, place=place)
        self.link.subscribe(keys.TELEMETRY, self._hear)
        self.console.start()
        return opened_s

    def close_console(self) -> None:
        """End the operator's site."""
        self.console.close()
        self.link.close()

    def _kill_robot(self) -> None:  # the present one
        self.robot.kill()

    def restart_robot(self) -> float:
        """Kill the robot's process and start it again; return when it was ready [s]."""
        self.robot.kill()
        self.robot = self._start_robot()
        return self.robot.ready_s

    def wait_for(self, what: str, holds: Callable[[ConsoleState], bool]) -> None:
        """Wait until the console's picture satisfies a condition.

        Raises:
            ProcessFailed: On a time-out.
        """
        if not self.console.wait_for(holds, PATIENCE_S):
            raise ProcessFailed(f"waited {PATIENCE_S:.0f} s for {what}")

    def wait_until_heard(self, what: str, fits: Callable[[Heard], bool]) -> Heard:
        """Wait for the first report that fits, and return it.

        Raises:
            ProcessFailed: When none came in time.
        """
        checked = 0

        def found() -> Heard | None:
            nonlocal checked
            for heard in self.heard[checked:]:
                checked += 1
                if fits(heard):
                    return heard
            return None

        with self._arrived:
            heard = self._arrived.wait_for(found, PATIENCE_S)
        if heard is None:
            raise ProcessFailed(f"waited {PATIENCE_S:.0f} s for {what}")
        return heard

    def _demo_arguments(self) -> list[str]:
        ready = self._link.ready
        return [
            "local", "--demo", f"--connect={self._transport}/{HOST}:{ready['port']}", f"--task={self._task}",
            *self._identity(_SITE),
            f"--data-dir={self.folder}", f"--link-control={HOST}:{ready['control_port']}",
            f"--seed={self._seed}", f"--link-rate-bps={self._rate_bps:g}",
        ]  # fmt: skip

    def _start_robot(self) -> ReadyProcess:
        return ReadyProcess(
            "remote", f"--listen={self._transport}/{HOST}:{self._robot_port}", f"--task={self._task}", f"--seed={self._seed}",
            *self._identity(EndpointSettings().vehicle), *self._list_of_sites(),
            f"--data-dir={self._folder.name}", f"--link-rate-bps={self._rate_bps:g}",
        )  # fmt: skip

    def _certificates(self, name: str) -> str:
        """Return the folder of a site's certificate, which is made when it is first asked for; empty over TCP."""
        if self._registry is None:
            return ""
        if name not in self._registry.rights:
            is_robot = name == EndpointSettings().vehicle
            self._registry.issue(
                name, "robot" if is_robot else "operator", (HOST,) if is_robot else (), _DAYS
            )
        return str(self._registry.folder_of(name))

    def _list_of_sites(self) -> list[str]:
        return [f"--sites={self.folder / 'pki' / RIGHTS_FILE}"] if self._listed else []

    def _identity(self, name: str) -> list[str]:
        certificates = self._certificates(name)
        return [f"--certificates={certificates}"] if certificates else []

    def _hear(self, data: bytes) -> None:
        heard = Heard(time.monotonic(), decode(data, Telemetry))
        with self._arrived:
            self.heard.append(heard)
            self._arrived.notify_all()
