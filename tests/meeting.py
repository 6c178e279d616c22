"""A real robot and real consoles in one process and in virtual time: nothing waits, nothing has a thread."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from farhand.common.clock import BootClock
from farhand.common.mode_table import Action, ControlMode
from farhand.common.task import PointTask, TaskSet
from farhand.common.wire.messages import Wish
from farhand.evaluation.harness.steered_world import SteppedTime
from farhand.local_site.console import intents
from farhand.local_site.console.console import Console
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.teaching.library import Library
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.motion.preview_worker import PlanRequest, plan
from farhand.remote_site.robot import Robot
from farhand.remote_site.robots.plant_memory import PlantState
from tests.loopback import OperatorsEnd, RobotsEnd
from tests.remote_site.bench import DT_S
from tests.remote_site.planar import TASK

_TICK_EVERY = 3
"""Robot's periods to one of a console's own."""


class Site:
    """One operator's site."""

    def __init__(self, meeting: Meeting, name: str, data_dir: Path, wish: Wish):
        self._meeting = meeting
        self.link = OperatorsEnd(meeting.robots_end)
        self.library = Library(meeting.tasks, data_dir)
        self.console = Console(
            self.library, self.link, name, wish=wish, now_s=lambda: meeting.sites_time.ns * 1e-9
        )
        self.console.listen()

    @property
    def picture(self) -> ConsoleState:
        return self.console.picture

    def told(self, words: str) -> bool:
        return any(words in f"{notice.what}: {notice.text}" for notice in self.picture.notices)

    def ask(self, *asked: intents.Intent | Action) -> ConsoleState:
        """Ask for something, and have half a second for what comes of it."""
        for intent in asked:
            self.console.submit(intents.CommandRobot(intent) if isinstance(intent, Action) else intent)
            self._meeting.run(0.5)
        return self.picture

    def wants(self, wish: Wish) -> ConsoleState:
        return self.ask(intents.WishControl(wish))

    def hand(self, x: float, y: float) -> None:
        now_s = self._meeting.sites_time.ns * 1e-9
        self.console.submit(intents.Hand((x, y), now_s))

    def drive(self, duration_s: float, x: float, y: float) -> None:
        """Hold the hand at a place, with an event in every period."""
        for _ in range(round(duration_s / DT_S)):
            self.hand(x, y)
            self._meeting.run(DT_S)


class Meeting:
    """One robot and whoever joins it.

    Args:
        tasks: What it does, and the sites teach.
        sites_ahead_s: What the sites' clocks are ahead of the robot's at first [s].
        sites_drift: What they gain on it, as a part of the time.
        config: Of the robot.
    """

    def __init__(
        self, tasks: Sequence[PointTask] = (TASK,), sites_ahead_s: float = 5000.0, sites_drift: float = 0.0,
        config: RemoteConfig | None = None,
    ):  # fmt: skip
        self._sites_drift, self._config = sites_drift, config or RemoteConfig()
        self.time, self.sites_time = SteppedTime(100.0), SteppedTime(100.0 + sites_ahead_s)
        self.robots_end = RobotsEnd()
        self.sites: list[Site] = []
        self.written: list[dict[str, Any]] = []
        self.tasks, self._boots, self._ticks = TaskSet(tasks), 0, 0
        self.robot = self._boot(None)

    def join(self, name: str, data_dir: Path, wish: Wish = Wish.CONTROL) -> Site:
        site = Site(self, name, data_dir, wish)
        self.sites.append(site)
        self.run(0.5)
        return site

    def leave(self, site: Site) -> None:
        """Its process ends without a word."""
        site.link.close()
        self.sites.remove(site)

    @property
    def mode(self) -> ControlMode:
        return self.robot.supervisor.mode

    @property
    def position_m(self) -> np.ndarray:
        return self.robot.supervisor.sensing.effector.position_m

    @property
    def speed_m_s(self) -> float:
        return float(np.linalg.norm(self.robot.supervisor.sensing.effector.velocity_m_s))

    def restart_robot(self) -> None:
        """Its process dies and is started again; only what its memory file would hold is left."""
        supervisor = self.robot.supervisor
        remembered = PlantState.of(supervisor.sensing, supervisor.motion)
        self.robots_end.forget()
        self.robot = self._boot(remembered)

    def run(self, duration_s: float) -> None:
        for _ in range(round(duration_s / DT_S)):
            self.time.advance(DT_S)
            self.sites_time.advance(DT_S * (1.0 + self._sites_drift))
            self._ticks += 1
            self.robot.step()
            for site in self.sites:
                site.console.owner.run_waiting()
                if self._ticks % _TICK_EVERY == 0:
                    site.console.owner.tick()

    def _boot(self, remembered: PlantState | None) -> Robot:
        self._boots += 1

        def request_plan(request: PlanRequest) -> None:
            robot.take_path(request, plan(request), None)

        robot = Robot(
            self._config, self.tasks, BootClock(f"boot {self._boots}", self.time), self.robots_end,
            request_plan, lambda **fields: self.written.append(fields), remembered,
        )  # fmt: skip
        return robot
