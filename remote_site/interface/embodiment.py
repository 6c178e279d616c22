"""What differs between robots beyond their plant and their sight: a protocol, and what it speaks of.

    Supervisor ── Motion, Manoeuvres, Execution, Reporter, PlantMemory
                       └── Embodiment: PointEmbodiment, ArmEmbodiment

Whoever is above the line takes from an embodiment what it needs of it and names no robot.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from msgspec import UnsetType
from numpy.typing import NDArray

from farhand.common.control_mode import Action, Phase
from farhand.common.task import AnyTask
from farhand.common.wire.messages import ArmState
from farhand.remote_site.interface.plant import EffectorState, Plant
from farhand.remote_site.perception.perception import Perception
from farhand.remote_site.perception.sensing import Sensing
from farhand.remote_site.reproduction.executor_settings import ExecutorSettings
from farhand.remote_site.robots.arm_memory import ArmMemory

Array = NDArray[np.float64]


class Way(Protocol):
    """Where a manoeuvre leads, and how fast."""

    @property
    def time_limit_s(self) -> float:
        """After which it ends where it is, at the full pace [s]."""
        ...

    def goal(self) -> Array:
        """Where it ends, as known now. Shape (C,)."""
        ...

    def speed_m_s(self) -> float:
        """How fast it may go now, at the full pace [m/s]."""
        ...


class Guidance(NamedTuple):
    """What contact asks of an execution in one control period.

    Args:
        waits: It must stand still.
        back: The point to go back to before it goes on; None when it may go on. Shape (C,).
        back_m_s: How fast [m/s].
        given_up: Why it must end; empty while it may go on.
    """

    waits: bool = False
    back: Array | None = None
    back_m_s: float = 0.0
    given_up: str = ""


class Check(NamedTuple):
    """What was found out about a motion before it begins.

    Args:
        refusal: Why it should not begin; empty when it may.
        warning: What the operator should know before; empty for nothing.
    """

    refusal: str = ""
    warning: str = ""


class Record(Protocol):
    """How an execution went, by what only a simulation, or a measuring machine, can know."""

    def measure(self, effector: EffectorState, arrived: bool, now_s: float, dt_s: float) -> None:
        """Take one control period into account."""
        ...

    def fields(self) -> dict[str, Any]:
        """Those of an `ExecutionReport` that it knows."""
        ...


class Embodiment(Protocol):
    """One robot, as far as it is not like any other."""

    control_hz: float
    """Its control rate [Hz]."""
    settings: ExecutorSettings
    """How it executes."""
    max_speed_m_s: float
    """Of its effector, in every mode [m/s]."""

    @property
    def task(self) -> AnyTask:
        """What it is at: the first of its tasks, until another one is executed."""
        ...

    @property
    def must_seat(self) -> bool:
        """Whether an execution of its task has arrived only once the tool is seated."""
        ...

    @property
    def plant(self) -> Plant:
        """What moves."""
        ...

    @property
    def perception(self) -> Perception:
        """Its sight."""
        ...

    @property
    def guidance(self) -> Guidance:
        """What contact asks of the execution now."""
        ...

    def attend(self, sensing: Sensing, executing: bool, now_s: float, dt_s: float) -> None:
        """Take into account what was sensed just now, in every mode: what is felt may correct what is seen.

        Args:
            sensing: The newest measurements; `believe` says what they mean.
            executing: Whether a model is executed and not paused.
            now_s: Now [s].
            dt_s: Control period [s].
        """
        ...

    def begin(self, task: AnyTask, now_s: float) -> None:
        """An execution begins, which makes its task the present one.

        Args:
            task: One of the robot's.
            now_s: Now [s].
        """
        ...

    def confined(self, reference: Array, sensing: Sensing) -> Array:
        """Where the effector may go of where the operator's hand leads it; the same array where it is free."""
        ...

    def way(self, phase: Phase, sensing: Sensing) -> Way | None:
        """Where the manoeuvre of a phase leads from here; None when there is none."""
        ...

    def refusal(self, action: Action, sensing: Sensing) -> str:
        """Why the robot cannot do what is asked from where it is; empty when it can."""
        ...

    def end_phase(self, sensing: Sensing) -> Phase:
        """SEATED or ARRIVED, at the end of a motion."""
        ...

    def new_record(self) -> Record:
        """Of an execution that has begun."""
        ...

    def check(self, task: AnyTask, sensing: Sensing) -> Callable[[], Check] | None:
        """What examines the motion of a task from here; it takes long and is called by another thread. None for nothing."""
        ...

    def move_target(self, position_m: Array) -> None:
        """Have the simulated target go to another place, within its bounds. Shape (D,) [m]."""
        ...

    def memory(self) -> ArmMemory | None:
        """What a next boot must know beyond where the effector is."""
        ...

    def arm_state(self, sensing: Sensing, overruns: int) -> ArmState | UnsetType:
        """What an arm reports beyond what a point does."""
        ...

    def scene(self) -> bytes:
        """What it looks like, see `farhand.common.wire.scene_description`; takes long, and is empty for a point."""
        ...
