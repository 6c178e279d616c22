"""Cost and use of the robot's camera: `.venv/bin/python -m benchmarks.camera [geo] [narrow] [acoustic] [commands] [periods] [page]`.

Real processes of the arm's task over the simulated link, pictures really drawn. Ages are true ones: robot and operator share this
machine's clock. All parts without an argument.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benchmarks.page_cost import processor_s, say, until
from farhand.common.clock import elapsed_s
from farhand.common.mode_table import Action, ControlMode
from farhand.common.wire.reason_words import sentence
from farhand.evaluation.harness.real_sites import RealSites
from farhand.local_site.console.intents import CommandRobot, WatchCamera
from tests.browser.raw_client import RawClient, raw_connection
from tests.browser.stack import farhand_up

_MEASURED_S = 20.0
_SAMPLE_S = 0.02
_GEO_BPS, _NARROW_BPS, _ACOUSTIC_BPS = 10e6, 60e3, 9600.0
_ONE_WAY_S = 0.3
_BLOCKS, _COMMANDS = 4, 8
_TASK = "hot-stab"


def main() -> int:
    """Measure and print all, or the named parts.

    Returns:
        The exit status: 0.
    """
    parts = {
        "geo": lambda: measure_pictures("geo", _GEO_BPS), "narrow": lambda: measure_pictures("60 kbit/s", _NARROW_BPS),
        "acoustic": measure_acoustic, "commands": measure_commands, "periods": measure_periods, "page": measure_page,
    }  # fmt: skip
    say(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    for name in sys.argv[1:] or parts:
        parts[name]()
    return 0


def measure_pictures(name: str, rate_bps: float) -> None:
    """Measure rate, size and age of the pictures over the delay of `geo` at a rate."""
    with RealSites(None, task=_TASK, profile="geo", rate_bps=rate_bps) as sites:
        limit = {"rate_bps": rate_bps}
        sites.control.set(uplink=limit, downlink=limit)
        sites.console.submit(WatchCamera(True))
        sites.wait_for("a picture", lambda state: state.camera.picture is not None)
        until_s, seen, sizes, ages_s = time.monotonic() + _MEASURED_S, set[int](), [], []
        while time.monotonic() < until_s:
            threading.Event().wait(_SAMPLE_S)
            picture = sites.console.picture.camera.picture
            assert picture is not None
            ages_s.append(elapsed_s() - picture.stamp.t_ns * 1e-9)
            if picture.seq not in seen:
                seen.add(picture.seq)
                sizes.append(len(picture.jpeg))
    say(
        f"{name + ':':12} {(len(seen) - 1) / _MEASURED_S:5.2f} pictures/s of {median(sizes):5.0f} B; shown age p50 "
        f"{np.quantile(ages_s, 0.5):5.2f} s, p95 {np.quantile(ages_s, 0.95):5.2f} s, of that one way {_ONE_WAY_S:g} s"
    )


def measure_acoustic() -> None:
    """Measure that an acoustic modem carries no picture, and what the page says."""
    with RealSites(None, task=_TASK, profile="acoustic", rate_bps=_ACOUSTIC_BPS) as sites:
        sites.console.submit(WatchCamera(True))
        sites.wait_for("an answer", lambda state: state.camera.why is not None)
        camera = sites.console.picture.camera
        say(
            f"9,600 bit/s: no picture: {sentence(camera.why)}; pictures: {0 if camera.picture is None else 1}"
        )


def measure_commands() -> None:
    """Measure the round trip of a command with and without pictures, in turn, over `geo` without jitter."""
    times_s: dict[bool, list[float]] = {False: [], True: []}
    with RealSites(None, task=_TASK, profile="geo", rate_bps=_GEO_BPS) as sites:
        sites.control.set(uplink={"jitter_ms": 0}, downlink={"jitter_ms": 0})
        sites.wait_for("the control", lambda state: state.in_control)
        while sites.console.picture.mode is not ControlMode.HOLD:
            _command(sites, CommandRobot(Action.ARM))
        for block in range(_BLOCKS):
            watches = block % 2 == 1
            sites.console.submit(WatchCamera(watches))
            if watches:
                sites.wait_for("a picture", lambda state: state.camera.picture is not None)
            for number in range(_COMMANDS):
                times_s[watches].append(_round_trip_s(sites, 0.5 + 0.05 * number))
    without, with_ = (1e3 * median(times_s[watches]) for watches in (False, True))
    say(
        f"command:     round trip p50 {without:.1f} ms without pictures, {with_:.1f} ms with them, of {_BLOCKS * _COMMANDS // 2} each"
    )


def _round_trip_s(sites: RealSites, pace: float) -> float:
    """Set the robot's pace until that was accepted, and return the round trip [s]."""
    n_before = len(sites.console.picture.command_round_trips_s)
    while len(sites.console.picture.command_round_trips_s) == n_before:
        _command(sites, CommandRobot(Action.SET_PACE, pace=pace))
    return sites.console.picture.command_round_trips_s[-1]


def _command(sites: RealSites, intent: CommandRobot) -> None:
    """Command the robot, and wait until that is settled, well or badly."""
    asked = threading.Event()
    sites.console.submit(intent)
    sites.console.owner.put(asked.set)  # after the intent
    asked.wait()
    sites.wait_for("an answer", lambda state: intent.action not in state.pending)


def measure_periods() -> None:
    """Measure the robot's control periods without and with pictures, each by a robot of its own."""
    for watches in (False, True):
        with RealSites(None, task=_TASK, profile="geo", rate_bps=_GEO_BPS) as sites:
            if watches:
                sites.console.submit(WatchCamera(True))
                sites.wait_for("a picture", lambda state: state.camera.picture is not None)
            threading.Event().wait(_MEASURED_S)
            sites.robot.send(signal.SIGTERM)
            sites.robot.wait()
            ticks = _ticks(sites.robot_events)
        say(
            f"periods:     {'with' if watches else 'without'} pictures: processor p50 {ticks['cpu_p50_ms']:.2f} ms, p99 "
            f"{ticks['cpu_p99_ms']:.2f} ms; late p99 {ticks['late_p99_ms']:.1f} ms; {ticks['n']} periods, {ticks['overruns']} skipped"
        )  # fmt: skip


def _ticks(events: Path) -> dict[str, Any]:
    lines = [json.loads(line) for line in events.read_text(encoding="utf-8").splitlines()]
    return [line for line in lines if line.get("kind") == "ticks"][-1]


def measure_page() -> None:
    """Measure the processor time of the operator's site and of the camera, with one tab that shows the pictures."""
    with (
        tempfile.TemporaryDirectory() as folder,
        farhand_up(Path(folder) / "data", link="geo", task=_TASK) as stack,
        raw_connection(stack.address) as connection,
    ):
        client = RawClient(connection)
        until(client, "data:image/jpeg")
        local, remote = (stack.process.children()[role] for role in ("local", "remote"))
        camera = _child_of(remote)
        before, began_s, n_pictures = [processor_s(pid) for pid in (local, camera)], time.monotonic(), 0
        while (left_s := began_s + _MEASURED_S - time.monotonic()) > 0.0:
            try:
                n_pictures += sum("data:image/jpeg" in str(message) for message in client.receive(left_s))
            except TimeoutError:
                break
        took_s = time.monotonic() - began_s
        page, drawn = (
            100 * (processor_s(pid) - b) / took_s for pid, b in zip((local, camera), before, strict=True)
        )
        say(
            f"page:        local site {page:.1f} % of a core with {n_pictures / took_s:.1f} pictures/s; the camera's process {drawn:.1f} %"
        )


def _child_of(pid: int) -> int:
    """Return the first child of a process."""
    children = Path(f"/proc/{pid}/task").glob("*/children")
    return next(int(child) for file in children for child in file.read_text(encoding="ascii").split())


if __name__ == "__main__":
    sys.exit(main())
