"""STOP pressed on the page while the operator's console is blocked for five seconds.

The operator's site is as it is shipped: console, page, link, and the operator's arm, each with its threads. In a
process of its own a client of the page presses STOP over its websocket, and the robot's end of the link takes the
time at which the press arrives there, both by one clock. Meanwhile the console

- learns: it undoes one after the other of several recordings of a minute, and learns what is left of them again
- writes: each write to the disk takes five seconds
- waits for the operator's arm, which is busy for five seconds
- is dead-locked on something that is free only after five seconds
- or does all of it, one after the other

Each case presses five times, at random moments.
"""

from __future__ import annotations

import multiprocessing
import os
import random
import tempfile
import threading
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from farhand.common.address import free_port
from farhand.common.arm.simulation.description import describe
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import ArmTask, TaskSet
from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.messages import Stop
from farhand.deploy.places import find_cell, find_task
from farhand.evaluation.harness.page_visitor import CAMERA, SUBPROTOCOL
from farhand.evaluation.metrics.tables import table
from farhand.evaluation.study import reporting_seeds
from farhand.local_site.console import intents
from farhand.local_site.console.console import Console
from farhand.local_site.learning.warm_up import warm_up
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.library import Library
from farhand.local_site.workcell.arm_drivers import LiveArm

Case = dict[str, Any]

LIMIT_S = 0.050
BLOCKS = ("learns", "writes", "waits for the arm", "is dead-locked", "does all of it")
PRESSES = 5
_BLOCKED_S, _TRIALS = 5.0, 20
_PATIENCE_S = 30.0
_N_RECORDINGS, _RECORDING_S = 6, 60.0


def cases(trials: int | None, seed: int) -> list[Case]:
    """List the cases: each kind of block in turn."""
    seeds = reporting_seeds(seed, trials or _TRIALS)
    return [
        {"block": BLOCKS[n % len(BLOCKS)], "presses": PRESSES, "seed": each} for n, each in enumerate(seeds)
    ]


def trial(case: Case) -> Case:
    """Open the operator's site, block its console, and press."""
    with tempfile.TemporaryDirectory(prefix="farhand-stop-lane-") as folder:
        return {
            **case,
            **_Site(Path(folder), case["block"]).press(case["presses"], random.Random(case["seed"])),
        }


class _Site:
    """Operator's site in this process; the presser and the robot's end in another."""

    def __init__(self, folder: Path, block: str):
        task = find_task("hot-stab")
        cell = find_cell(task)
        assert isinstance(task, ArmTask) and cell is not None
        warm_up(task.space, len(task.frame_names))
        self._block, self._slow_s = block, 0.0
        self._library, self._place = Library(TaskSet([task]), folder / "data"), LiveArm(task, cell)
        self._own = describe(cell)
        self._folder = folder
        long = block in ("learns", "does all of it")
        n, each_s = (_N_RECORDINGS, _RECORDING_S) if long else (2, 2.0)
        self._library.chosen.learn([_recording(task, number, each_s) for number in range(n)])

    def press(self, n: int, moments: random.Random) -> Case:
        """Press a number of times while the console is blocked."""
        from farhand.local_site.view.page import Page
        from farhand.local_site.view.page_access import PageAccess, kept_token

        endpoint = f"tcp/127.0.0.1:{free_port()}"
        ours, theirs = multiprocessing.get_context("spawn").Pipe()
        operator = multiprocessing.get_context("spawn").Process(
            target=_press, args=(theirs, endpoint), daemon=True
        )
        operator.start()
        assert ours.recv() == "listening"
        link = ZenohLink(EndpointSettings(connect=endpoint))
        console = Console(self._library, link, "operator", place=self._place)
        access = PageAccess("127.0.0.1", (), kept_token(self._folder))
        page = Page(console, self._library.task, None, access, 0, self._own)
        fsync = os.fsync
        os.fsync = self._slow_fsync
        try:
            console.start()
            page.start()
            ours.send((page.address, page._stop.handles[0]._impl.uuid))
            assert ours.recv() == "connected"
            return self._press_while_blocked(console, ours, n, moments)
        finally:
            os.fsync = fsync
            page.close()
            console.close()
            link.close()
            ours.send("end")
            operator.join(_PATIENCE_S)

    def _press_while_blocked(self, console: Console, pipe: Any, n: int, moments: random.Random) -> Case:
        free = threading.Event()
        began_s = time.monotonic()
        self._slow_s = _BLOCKED_S
        for intent in self._asked(console):
            console.submit(intent)
        console.owner.put(free.set)
        took_s, blocked_s = [], []
        for at_s in sorted(moments.uniform(0.5, 0.9 * _BLOCKED_S) for _ in range(n)):
            time.sleep(max(0.0, began_s + at_s - time.monotonic()))
            blocked = not free.is_set()
            pipe.send("press")
            took_s.append(pipe.recv())
            blocked_s.append(blocked and not free.is_set())
        self._slow_s = 0.0
        assert free.wait(_PATIENCE_S * 2), "the console never went on"
        return {"took_s": took_s, "blocked": blocked_s, "blocked_s": time.monotonic() - began_s}

    def _asked(self, console: Console) -> list[intents.Intent]:
        """Return the intents that block the console; a deadlock needs none."""
        match self._block:
            case "learns":
                return [intents.Undo()] * (_N_RECORDINGS - 1)
            case "writes":
                return [intents.Undo()]
            case "waits for the arm":
                self._place._jobs.put(self._pause)
                return [intents.ResetArm()]
            case "is dead-locked":
                console.owner.put(self._pause)
                return []
            case _:
                self._place._jobs.put(self._pause)
                return [intents.Undo(), intents.ResetArm(), intents.Undo()]

    @staticmethod
    def _pause() -> None:
        threading.Event().wait(_BLOCKED_S)

    def _slow_fsync(self, _descriptor: int) -> None:
        time.sleep(self._slow_s)


def _recording(task: ArmTask, n: int, duration_s: float) -> Demonstration:
    """Return a motion, sampled at 100 Hz."""
    rng, time_s = np.random.default_rng(n), np.arange(0.0, duration_s, 0.01)
    s = (1.0 - np.cos(np.pi * time_s / duration_s)) / 2.0
    begin = np.array([0.3, 0.1, -0.4]) + 0.02 * rng.normal(size=3)
    position_m = (1.0 - s)[:, None] * begin + 0.02 * np.sin(np.outer(s, rng.uniform(3.0, 6.0, size=3)))
    return Demonstration(
        time_s=time_s, position_m=position_m, quat_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (time_s.size, 1)),
        frame_origin_m=np.zeros((1, 3)), frame_rotation=TaskFrame.identity(3).A[None],
        frame_names=tuple(task.frame_names), source=f"recording {n}",
    )  # fmt: skip


# Other process ----------------------------------------------------------------------------------


def _press(pipe: Connection, endpoint: str) -> None:
    """Be the robot's end of the link and a client of the page: press when told, and report the delay."""
    from websockets.sync.client import connect

    link = ZenohLink(EndpointSettings(listen=endpoint))
    arrivals: dict[str, float] = {}
    arrived = threading.Condition()

    def hear(data: bytes) -> None:
        now_s, stop = time.monotonic(), decode(data, Stop)
        with arrived:
            arrivals.setdefault(stop.stop_id, now_s)
            arrived.notify_all()

    link.subscribe(keys.STOP, hear)
    pipe.send("listening")
    address, button = pipe.recv()
    with connect(
        address.replace("http", "ws"), subprotocols=[SUBPROTOCOL], max_size=None, max_queue=None
    ) as page:
        page.send(msgspec.msgpack.encode(CAMERA))
        page.recv(_PATIENCE_S)
        pipe.send("connected")
        while pipe.recv() == "press":
            known, pressed_s = set(arrivals), time.monotonic()
            page.send(
                msgspec.msgpack.encode(
                    {"type": "GuiUpdateMessage", "uuid": button, "updates": {"value": True}}
                )
            )
            with arrived:
                arrived.wait_for(lambda known=known: arrivals.keys() - known, _PATIENCE_S)
                new = arrivals.keys() - known
            pipe.send(min((arrivals[each] for each in new), default=float("inf")) - pressed_s)
    link.close()


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Tabulate each kind of block, and all presses."""
    rows, all_s, in_time = [], [], 0
    for block in BLOCKS:
        mine = [result for result in results if result["block"] == block]
        took_s = [each for result in mine for each in result["took_s"]]
        if not took_s:
            continue
        good = sum(each <= LIMIT_S for each in took_s)
        blocked = sum(sum(result["blocked"]) for result in mine)
        rows.append((block, len(took_s), blocked, good, *(1e3 * np.quantile(took_s, (0.5, 0.99, 1.0)))))
        all_s, in_time = all_s + took_s, in_time + good
    summary = {
        "presses": len(all_s), "in_time": in_time, "most_ms": 1e3 * max(all_s), "passed": in_time == len(all_s),
        "limit_ms": 1e3 * LIMIT_S,
    }  # fmt: skip
    header = ("the console", "presses", "while blocked", "in time", "p50 ms", "p99 ms", "max ms")
    lines = [
        "# STOP while the console is blocked", "", _TEXT, "",
        f"On the wire within {1e3 * LIMIT_S:.0f} ms: {in_time} of {len(all_s)}.", "", table(header, rows),
    ]  # fmt: skip
    return summary, "\n".join(lines)


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()
