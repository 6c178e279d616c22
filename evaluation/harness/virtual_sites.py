"""Both sites' own code in one process and in virtual time: robot, link, console."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from farhand.common.clock import BootClock, VirtualTime
from farhand.common.impairment.impairment import LinkSettings
from farhand.common.impairment.virtual_link import VirtualLink
from farhand.common.link.interface import Link
from farhand.common.task import TaskSet
from farhand.deploy.places import find_cell
from farhand.local_site.console.console import PERIOD_S, Console
from farhand.local_site.exchange.fetching import KnownScenes
from farhand.local_site.teaching.library import Library
from farhand.local_site.workcell.workcell import SampleFiles, make_workcell, no_files
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.embodiment import Embodiment
from farhand.remote_site.motion.preview_worker import PlanRequest, answer
from farhand.remote_site.robot import Robot
from farhand.remote_site.robots.plant_memory import PlantState

_PLANNING_S = 0.05
"""Assumed duration of a rollout in virtual time [s]."""
_CLOCK_APART_S = 4321.0
"""Offset of the sites' clocks, which are independent [s]."""


@dataclass(frozen=True)
class Hooks:
    """Callbacks of the robot's loop, for an observer.

    Args:
        before: Called before a control period.
        between: Called after the arrived messages were handled, before the robot moves.
        after: Called after the period.
    """

    before: Callable[[], None] = lambda: None
    between: Callable[[], None] = lambda: None
    after: Callable[[], None] = lambda: None


_NO_HOOKS = Hooks()


class VirtualRobot:
    """Robot as in its own process, but without threads and files: it runs as the time passes.

    Args:
        time: The time.
        end: The robot's end of the link.
        config: Configuration of the robot.
        tasks: Tasks of the robot.
        life: Number of starts, this one included; its clock is independent of the previous life's.
        remembered: State in its last life.
        hooks: Returns the observer's callbacks, in every period.
        embodiment: Embodiment; the simulated robot of the first task when not given.
    """

    def __init__(
        self,
        time: VirtualTime,
        end: Link,
        config: RemoteConfig,
        tasks: TaskSet,
        life: int = 1,
        remembered: PlantState | None = None,
        hooks: Callable[[], Hooks] = lambda: _NO_HOOKS,
        embodiment: Embodiment | None = None,
    ):
        self._time, self._hooks, self._ended = time, hooks, False
        self.written: list[dict[str, Any]] = []
        """Log of the robot."""
        clock = BootClock(f"boot {life}", lambda: time.now_ns() + round(life * _CLOCK_APART_S * 1e9))
        self.robot = Robot(
            config, tasks, clock, end, self._plan, lambda **fields: self.written.append(fields), remembered,
            embodiment, cell=None if embodiment else find_cell(tasks.first, config.robot),
        )  # fmt: skip
        self._period_s = 1.0 / self.robot.embodiment.hardware.control_hz

    def start(self) -> None:
        """Run from now on."""
        self._tick(self._time.now_s())

    def end(self) -> None:
        """Stop running."""
        self._ended = True

    def _tick(self, due_s: float) -> None:
        if self._ended:
            return
        hooks = self._hooks()
        hooks.before()
        self.robot.handle()
        hooks.between()
        self.robot.move()
        hooks.after()
        due_s += self._period_s
        self._time.call_at(due_s, partial(self._tick, due_s))

    def _plan(self, request: PlanRequest) -> None:
        """Roll out previews, but not the committed path, which only serves display."""
        if request.plan_id:
            self._time.call_later(_PLANNING_S, lambda: self.robot.take_path(request, *answer(request)))


class VirtualSites:
    """Robot and operator's console, each as in its own process, but without threads and files.

    Args:
        library: Lessons of the robot's tasks.
        settings: First settings of the link.
        config: Configuration of the robot.
        hooks: Callbacks for an observer of the robot.
        sample_files: The demonstrations that come with each task.
        own_arm: Name or file of the operator's arm.
        known: Drawings that need not be fetched; None when nobody draws the robot.
    """

    def __init__(
        self,
        library: Library,
        settings: LinkSettings,
        config: RemoteConfig | None = None,
        hooks: Hooks | None = None,
        sample_files: SampleFiles = no_files,
        own_arm: str = "",
        known: KnownScenes | None = None,
    ):
        self._own_arm, self._known = own_arm, known
        self.task, self.library, self._sample_files = library.task, library, sample_files
        self.config, self.hooks = config or RemoteConfig(), hooks or Hooks()
        self.time = VirtualTime(start_s=1.0)
        self.link = VirtualLink(self.time, settings)
        self.console_frozen = False
        """True while the console's process hangs: it does and sends nothing."""
        self._robot_lives = self._console_lives = 0
        self.restart_robot()
        self.restart_console()

    @property
    def robot(self) -> Robot:
        """Robot of this boot."""
        return self._running.robot

    @property
    def written(self) -> list[dict[str, Any]]:
        """Log of the robot in this boot."""
        return self._running.written

    def run(self, duration_s: float) -> None:
        """Advance the time [s]."""
        self.time.run_until(self.time.now_s() + duration_s, self._wake_console)

    def restart_robot(self, down_s: float = 0.0) -> None:
        """Kill the robot's process and start it again after a pause [s]; its arm is where it was."""
        remembered: PlantState | None = None
        if self._robot_lives:
            remembered = PlantState.of(self.robot.supervisor.sensing, self.robot.supervisor.motion)
            self._running.end()
            self._robot_end.close()
        self._robot_lives += 1
        if down_s:
            self.time.call_later(down_s, partial(self._start_robot, remembered, self._robot_lives))
        else:
            self._start_robot(remembered, self._robot_lives)

    def restart_console(self, down_s: float = 0.0) -> None:
        """Kill the operator's process and start it again after a pause [s]."""
        if self._console_lives:
            self.console.close()
            self.console_end.close()
        self._console_lives += 1
        if down_s:
            self.time.call_later(down_s, partial(self._start_console, self._console_lives))
        else:
            self._start_console(self._console_lives)

    # The robot ----------------------------------------------------------------------------------

    def _start_robot(self, remembered: PlantState | None, life: int) -> None:
        if life != self._robot_lives:
            return  # killed again before it had started
        self._robot_end = self.link.remote_end()
        self._running = VirtualRobot(
            self.time, self._robot_end, self.config, self.library.tasks, life, remembered, lambda: self.hooks
        )
        self._running.start()

    # The console --------------------------------------------------------------------------------

    def _start_console(self, life: int) -> None:
        self.console_end = self.link.local_end()
        self.console = Console(
            self.library, self.console_end, "operator", now_s=self.time.now_s,
            rate_bps=self.config.link.rate_bps, place=make_workcell(
                self.task, find_cell(self.task, self._own_arm), self._sample_files, stepped=True
            ),
            known=self._known,
        )  # fmt: skip
        self.console.listen()
        self._console_tick(life)

    def _console_tick(self, life: int) -> None:
        if life != self._console_lives:
            return
        if not self.console_frozen:
            self.console.owner.tick()
        self.time.call_later(PERIOD_S, partial(self._console_tick, life))

    def _wake_console(self) -> None:
        if not self.console_frozen:
            self.console.owner.run_waiting()
