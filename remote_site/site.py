"""Remote process: the robot with its transport, its files, the preview worker's thread and its control loop.

Durations and lateness of control periods, as numbers that are written once a minute.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from msgspec import structs

from farhand.common.arm.cell import Cell
from farhand.common.clock import BootClock, Rate, SuspendWatch
from farhand.common.json_lines import JsonLinesFile
from farhand.common.link.endpoint import EVERY_SITE
from farhand.common.link.link import ZenohLink
from farhand.common.log import loop_logger
from farhand.common.mode_table import ControlMode
from farhand.common.process_status import DataFolder, RobotFacts
from farhand.common.task import TaskSet
from farhand.common.whole_file import Claim
from farhand.common.wire.messages import EventKind, PlannedPath
from farhand.common.wire.reason_words import sentence
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.camera.camera_process import camera_of
from farhand.remote_site.camera.robot_camera import RobotCamera
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.driver import call_all, halts_of
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.motion.model_trial import ModelTrials
from farhand.remote_site.motion.preview_worker import PlanRequest, PreviewWorker
from farhand.remote_site.reproduction.warm_up import warm_up
from farhand.remote_site.robot import Robot
from farhand.remote_site.robots.embodiments import embodiment_of
from farhand.remote_site.robots.installed import in_operation
from farhand.remote_site.robots.plant_memory import PERIOD_S, PlantMemory, PlantState

_log = loop_logger(__name__)

LINE_PERIOD_S = 60.0
"""Time that one line covers [s]."""


class TickTimes:
    """Collector of the times of control periods.

    Args:
        write: Writes one line, from its fields; never blocks.
        control_hz: Control periods per second [Hz].
    """

    def __init__(self, write: Callable[..., Any], control_hz: float):
        self._write, self._n = write, round(LINE_PERIOD_S * control_hz)
        self._cpu_s: list[float] = []
        self._late_s: list[float] = []

    def add(self, cpu_s: float, late_s: float, overruns: int) -> None:
        """Add one control period.

        Args:
            cpu_s: Processor time of the control loop's own thread [s].
            late_s: Lateness of its beginning [s].
            overruns: Number of control periods of this boot that were skipped because they came too late.
        """
        self._cpu_s.append(cpu_s)
        self._late_s.append(late_s)
        if len(self._cpu_s) >= self._n:
            self.tell(overruns)

    def tell(self, overruns: int) -> None:
        """Write the numbers and start a new line."""
        if not self._cpu_s:
            return
        fields: dict[str, float] = {"n": len(self._cpu_s), "overruns": overruns}
        for name, times_s in (("cpu", self._cpu_s), ("late", self._late_s)):
            for part, value in zip(
                ("p50", "p99", "max"), np.quantile(times_s, (0.5, 0.99, 1.0)), strict=True
            ):
                fields[f"{name}_{part}_ms"] = round(1e3 * float(value), 3)
            times_s.clear()
        self._write(kind="ticks", **fields)


class _Boot(NamedTuple):
    """Beginning of one life of the robot."""

    clock: BootClock
    embodiment: Embodiment
    remembered: PlantState | None
    reasons: list[Reason]


class RemoteSite:
    """Process of one robot.

    Args:
        config: Endpoints, rates, limits.
        tasks: Tasks of the robot.
        data_dir: Folder of its events and of the simulated robot's state.
        cell: Arm in front of its receptacle, for the tasks of an arm.
    """

    def __init__(self, config: RemoteConfig, tasks: TaskSet, data_dir: Path, cell: Cell | None = None):
        self._config, self._tasks, self._cell = config, tasks, cell
        self._data_dir = data_dir / "robot" / config.link.vehicle
        self._stop = threading.Event()
        self._robot: Robot | None = None
        self._ticked_s = 0.0
        self._files: tuple[PlantMemory | JsonLinesFile, ...] = ()

    def stop(self) -> None:
        """Ask the loop to end; safe in a signal handler."""
        self._stop.set()

    def data_folder(self) -> DataFolder:
        """Return the state of the data folder; from any thread."""
        return DataFolder.of(self._data_dir, *(file.error for file in self._files))

    def facts(self) -> RobotFacts | None:
        """Return the state of the robot, None while it starts; from any thread."""
        if (robot := self._robot) is None:
            return None
        supervisor, now_s = robot.supervisor, time.monotonic()
        stopped = supervisor.mode is ControlMode.STOPPED
        stop = supervisor.events.newest(EventKind.STOPPED) if stopped else None
        newest = supervisor.models.newest
        return RobotFacts(
            mode=supervisor.mode, phase=supervisor.phase, holder=supervisor.contact.lease.holder,
            heard_s=supervisor.contact.heard_s, tick_age_s=now_s - self._ticked_s,
            overruns=robot.overruns, control_hz=robot.embodiment.hardware.control_hz,
            model=newest.sha256[:8] if newest is not None else "",
            stopped_because=sentence(stop.reason, stop.cause) if stop is not None else "",
            stopped_by_fault=stop is not None and not stop.who, waiting=robot.waiting,
            not_understood=supervisor.contact.not_understood, misnamed=supervisor.contact.misnamed,
        )  # fmt: skip

    def tell_refused(self, words: str) -> None:
        """Tell that somebody was refused, in the log and as an event of the robot; from any thread."""
        if (robot := self._robot) is not None:
            robot.tell_refused(words)
        else:
            _log.warning(words)

    def warm_up(self) -> None:
        """Compile the kernels of a control period: about a minute at the first start on a machine."""
        warm_up(self._tasks.first.space)

    def run(self, ready: Callable[[], None]) -> None:
        """Serve until stopped.

        Args:
            ready: Called once the endpoint is open, the kernels are compiled and the loop is about to run.

        Raises:
            LinkError: When the endpoint cannot be opened.
            DriverFailed: When a driver of the user's own cannot be started.
        """
        # The preview worker and the link's threads must not delay a control tick.
        sys.setswitchinterval(5e-4)
        self.warm_up()
        claim = Claim(self._data_dir, "the state of its robot")
        memory = PlantMemory(self._data_dir / "state.json")
        event_log = JsonLinesFile(self._data_dir / "events.jsonl")
        self._files = memory, event_log
        try:
            why = self._boot(memory, event_log, ready, None)
            while not self._stop.is_set():
                why = self._boot(memory, event_log, lambda: None, why)
        finally:
            memory.close()
            event_log.close()
            claim.release()

    def _boot(
        self, memory: PlantMemory, event_log: JsonLinesFile, ready: Callable[[], None], why: Reason | None
    ) -> Reason | None:
        """Run one life of the robot, until it is stopped or must restart; return the reason of a restart."""
        clock, task = BootClock(), self._tasks.first
        remembered = memory.load(task.space.n_dims)
        measures_its_place = self._config.plant.use or self._config.arm_driver.use
        reasons = [why] if measures_its_place else [why, memory.unknown_place]
        with in_operation(self._config, task, self._cell, clock.now_s()) as drivers:
            embodiment = embodiment_of(task, self._config, clock, remembered, self._cell, drivers)
            boot = _Boot(clock, embodiment, remembered, [reason for reason in reasons if reason])
            return self._serve(boot, memory, event_log, ready)

    def _serve(
        self, boot: _Boot, memory: PlantMemory, event_log: JsonLinesFile, ready: Callable[[], None]
    ) -> Reason | None:
        """Open the link and run the loop of one life."""
        link = ZenohLink(structs.replace(self._config.link, site=EVERY_SITE), self.tell_refused)

        def take_path(request: PlanRequest, path: PlannedPath | None, note: Reason | None) -> None:
            robot.take_path(request, path, note)  # needs the worker first

        previews, trials = PreviewWorker(take_path), ModelTrials()
        shutter = camera_of(self._config, self._tasks.first, self._cell)
        camera = RobotCamera(link, boot.clock, self._config.link.rate_bps, shutter)
        hardware = boot.embodiment.hardware
        try:
            robot = Robot(
                self._config, self._tasks, boot.clock, link, previews.request, event_log.append,
                boot.remembered, boot.embodiment, try_model=trials.submit_trial, observe=camera.observe,
            )  # fmt: skip
            for reason in boot.reasons:
                robot.supervisor.machine.tell(EventKind.RESTARTED, reason, succeeded=False)
            _log.info("the robot is ready: %s", self._config.link.endpoint)
            camera.start()
            self._ticked_s, self._robot = time.monotonic(), robot
            ready()
            return self._loop(robot, link, memory, TickTimes(event_log.append, hardware.control_hz))
        finally:
            call_all(
                halts_of(hardware.plant, hardware.perception)
            )  # first: nobody controls the machine any more
            camera.close()
            trials.close()
            previews.close()
            link.close()

    def _loop(
        self, robot: Robot, link: ZenohLink, memory: PlantMemory, times: TickTimes
    ) -> Reason | None:  # fmt: skip
        control_hz = robot.embodiment.hardware.control_hz
        remember_every = max(1, round(PERIOD_S * control_hz))
        look_every, warned = round(LINE_PERIOD_S * control_hz), ""
        rate, suspend = Rate(1.0 / control_hz, self._stop), SuspendWatch()
        tick = 0
        while rate.wait():
            if (suspended_s := suspend.suspended_s()) > 0.0:
                robot.supervisor.failsafe.run(partial(_remember, robot, memory))
                robot.supervisor.motion.halt(1.0 / control_hz)
                return because(Code.SUSPENDED, suspended_s=suspended_s)
            robot.overruns = rate.overruns
            robot.supervisor.contact.reports_every(link.report_gap_s)
            self._ticked_s, began_ns = time.monotonic(), time.thread_time_ns()
            robot.step(rate.late_s)
            times.add((time.thread_time_ns() - began_ns) * 1e-9, rate.late_s, rate.overruns)
            if tick % look_every == 0 and (warning := link.warning()) != warned:
                warned = warning
                if warning:
                    self.tell_refused(warning)
            if tick % remember_every == 0:
                robot.supervisor.failsafe.run(partial(_remember, robot, memory))
            tick += 1
        times.tell(rate.overruns)
        return None


def _remember(robot: Robot, memory: PlantMemory) -> None:
    memory.remember(PlantState.of(robot.supervisor.sensing, robot.supervisor.motion))
